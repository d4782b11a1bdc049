"""What stops a check: the rules that `check` and `validate` judge a robot file by.

Each rule is a function from a draft to problems. `refusal.refuse` raises the first one
that stops a check; the checks of `borecheck.validation` tell all of them, with reasons.
"""
