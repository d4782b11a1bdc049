"""The 64 trials of [Matsuno2020]: published results, an error model, reruns."""
