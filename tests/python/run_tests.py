"""run_tests.py NAME: runs one file of tests. Exit code 77 where nothing could run: SKIPPED."""

import sys
import unittest

SKIPPED = 77


class Result(unittest.TextTestResult):
    """Skips what the module was built without (DTR_WITH_PRUNE=OFF, ...)."""

    def addError(self, test, error):
        if "this program was built without '" in str(error[1]):
            self.addSkip(test, str(error[1]))
        else:
            super().addError(test, error)


if __name__ == "__main__":
    try:
        import numpy  # noqa: F401
    except ImportError as missing:
        print(f"SKIPPED: {missing} (Debian: python3-numpy)")
        sys.exit(SKIPPED)
    suite = unittest.defaultTestLoader.loadTestsFromName(sys.argv[1])
    result = unittest.TextTestRunner(verbosity=2, resultclass=Result).run(suite)
    if not result.wasSuccessful() or result.testsRun == 0:
        sys.exit(1)
    sys.exit(SKIPPED if result.skipped else 0)
