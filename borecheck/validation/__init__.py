"""The validator of URDF and xacro files: everything that is wrong, in one run.

`validate_file` is the whole of it for Python; `borecheck validate` prints the same.
"""

from borecheck.validation.findings import Finding, Severity
from borecheck.validation.options import Options
from borecheck.validation.run import validate_file, validate_text

__all__ = ["Finding", "Options", "Severity", "validate_file", "validate_text"]
