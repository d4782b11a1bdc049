"""The 6-DoF arm for an open 0.23 T magnet, [Heikkila2010]: what is special to it."""
