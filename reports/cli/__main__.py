"""`python -m reports.cli`: the command `actuator-lti` where no script is on the path."""

import sys

from reports.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
