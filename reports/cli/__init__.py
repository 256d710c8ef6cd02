"""The command line: one command a file; a command imports what it needs when it runs, not before."""
