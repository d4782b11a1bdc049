"""Girths of men and women by body mass index, as they were measured.

[NHANES] National Health and Nutrition Examination Survey 2017 to March 2020, body
measures (P_BMX), adults: 4,081 men and 4,221 women with all measures. The numbers are
means at that body mass index, each by a straight line through the persons within 1.25
kg/m2 of it, without the survey's weights; `studies/body_baking/nhanes.py` prints them.
Waists are measured above the hip bone, hips where they are widest, standing.
"""

KEYS = (20.0, 22.5, 25.0, 27.5, 30.0, 32.5, 35.0, 37.5, 40.0, 42.5, 45.0)

# Mean statures there, [m].
STATURE = {"m": 1.738, "f": 1.601}

_WAIST_M = (0.773, 0.841, 0.916, 0.985, 1.050, 1.110, 1.169, 1.225, 1.272, 1.336, 1.369)
_HIP_M = (0.886, 0.932, 0.972, 1.013, 1.056, 1.100, 1.143, 1.200, 1.248, 1.296, 1.337)
_WAIST_F = (0.749, 0.815, 0.883, 0.939, 0.997, 1.047, 1.101, 1.146, 1.199, 1.227, 1.275)
_HIP_F = (0.901, 0.950, 0.993, 1.039, 1.088, 1.134, 1.183, 1.245, 1.287, 1.328, 1.381)

# Waist and hips at each of KEYS, [m].
GIRTHS = {"m": (_WAIST_M, _HIP_M), "f": (_WAIST_F, _HIP_F)}

# Of a whole body with air in its lungs, [kg/m3]; assumed: tissue has 0.9 (fat) to 1.1
# kg/l (lean), and 2 to 3 l of air are in it.
DENSITY = 985.0
