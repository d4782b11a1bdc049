"""borecheck: will a needle robot touch the scanner it works in?"""
