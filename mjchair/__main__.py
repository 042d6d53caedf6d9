"""`python -m mjchair` is `mjchair`."""

from mjchair.cli import main

raise SystemExit(main())
