"""The validator of URDF and xacro files: everything that is wrong, in one run.

`validate_file` is the whole of it for Python; `borecheck validate` prints the same.
"""

from borecheck.validate.findings import Finding, Severity
from borecheck.validate.options import Options
from borecheck.validate.run import validate_file, validate_text

__all__ = ["Finding", "Options", "Severity", "validate_file", "validate_text"]
