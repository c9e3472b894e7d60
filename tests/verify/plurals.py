"""What texts for people must not say: "1 particles", "1 mode are", braces left of a text with both numbers, more digits than a number needs."""
import re

NOUNS = ("particles|springs|anchors|ranks|dimensions|states|steps|frames|attempts|rows|components|hinges|modes|motions|bodies|equilibria|iterations|unknowns|tangents|times|solves|"
         "directions|changes|avalanches|options|warnings|factorisations|numbers|entries|lines|words|columns|bytes|sources|characters|pairs|ends|groups|neighbours|cells|layers|files")
PLURAL = re.compile(rf"(?<![\d.=])1 (?:[a-zA-Z]+ ){{0,2}}(?:{NOUNS})\b(?!=)|(?<![\d.=])1 [a-zA-Z]+ (?:are|were|have)\b|[{{}}]")
BESIDE = re.compile(rf"(?<![\d.=])1 (?:{NOUNS})\b")  # of messages, which may quote what was read
LONG = re.compile(r"\d\.\d{15,}|\d\.?\d{16,}")
