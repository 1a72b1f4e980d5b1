"""What the commands do, a module a command, each with ``run(options) -> exit code``."""
