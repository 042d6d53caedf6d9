"""The command line's subcommands: each file has `add(subparsers)` and `run(args) -> exit code`."""
