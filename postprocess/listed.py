"""Options that take several values: with commas between them, or the option repeated, which adds to what was said before it."""
import argparse


class Listed(argparse.Action):
    """Of a text with commas or, where the option has a type that makes lists, of a list; the default holds where nothing is said."""

    def __init__(self, option_strings, dest, **more):
        super().__init__(option_strings, dest, **more)
        self.said = False

    def __call__(self, parser, namespace, values, option=None):
        before = getattr(namespace, self.dest) if self.said else None
        self.said = True
        setattr(namespace, self.dest, values if before is None else before + values if isinstance(values, list) else f"{before},{values}")
