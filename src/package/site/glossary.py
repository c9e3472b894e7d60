"""The glossary of option prefixes, from what `backspring -help` prints."""
import collections
import re

LEAST = 3  # options that share a prefix of PETSc's


def options(text):
    """[(section, option, meaning)] in the order of -help, each option once."""
    section, seen, found = "", set(), []
    for line in text.splitlines():
        option = re.match(r"\s+-([a-z]\w*)[:>]?\s?(.*)", line)
        if option and option[1] not in seen:
            seen.add(option[1])
            found.append((section, option[1], re.sub(r"^<.*?>:? ?", "", option[2])))
        elif not option and re.match(r"\S.*:$|\s{1,2}[A-Z].* options:?$", line):
            section = line.strip().rstrip(":")
    return found


def prefix_of(option):
    """bs_lattice of bs_lattice_size; ts of ts_max_time."""
    words = option.split("_")
    return "_".join(words[:2]) if words[0] == "bs" else words[0]


def slug(title):
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def page(text, reference):
    """The page; `reference` is the text of the options' reference, to whose sections the prefixes of the program lead."""
    sections = set(re.findall(r"^## (.*)$", reference, re.M))
    groups = collections.defaultdict(list)
    for section, option, meaning in options(text):
        groups[prefix_of(option)].append((section, option, meaning))
    own = {name: rows for name, rows in groups.items() if name.startswith("bs_")}
    foreign = {name: rows for name, rows in groups.items() if not name.startswith("bs_") and len(rows) >= LEAST}
    lines = ["# Prefixes of options", "",
             "What the beginning of an option's name says: made of what `backspring -help` prints when this site is built. `NAME` stands for a group, force or motion of yours.", "",
             "## Of the program", "", "| prefix | options | where they are explained |", "|---|---|---|"]
    for name, rows in sorted(own.items()):
        titles = list(dict.fromkeys(section for section, _, _ in rows if section in sections))
        links = ", ".join(f"[{title}](../../../options/reference/README.md#{slug(title)})" for title in titles)
        names = ", ".join(f"`-{option}`" for _, option, _ in rows)
        lines.append(f"| `-{name}` | {names} | {links} |")
    lines += ["", "## Of PETSc", "", "In effect where the part is used; the manual of PETSc explains them. How many there are says how much of the part can be chosen.", "",
              "| prefix | options | PETSc's own headings |", "|---|---|---|"]
    for name, rows in sorted(foreign.items()):
        count = collections.Counter(section for section, _, _ in rows)
        titles = ", ".join(title.replace("|", "\\|") for title, _ in count.most_common(3))
        lines.append(f"| `-{name}_` | {len(rows)}, for example `-{rows[0][1]}` | {titles} |")
    return "\n".join(lines) + "\n"
