"""Zerobot, the CT needle robot of [Matsuno2020]: what is special to it."""
