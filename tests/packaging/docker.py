"""Readers of the Dockerfile, of Apptainer's definition and of .dockerignore, as far as the recipes of this project use them."""
import fnmatch
import re
import shutil


def joined(text):
    """Lines without comments, continued ones as one."""
    kept = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#"))
    return re.sub(r"\s*\\\n\s*", " ", kept).splitlines()


def read(path):
    """{stage: [(INSTRUCTION, rest)]} of a Dockerfile. A stage begins from debian:12 or from an earlier one; other words are an error."""
    stages, current = {}, None
    for line in filter(str.strip, joined(path.read_text())):
        word, _, rest = line.partition(" ")
        if word not in ("FROM", "RUN", "COPY", "WORKDIR", "ARG", "ENV", "ENTRYPOINT", "CMD"):
            raise ValueError(f"{path.name}: {word} is no instruction that is known here")
        if word == "FROM":
            base, name = re.fullmatch(r"(\S+) AS (\w+)", rest.strip()).groups()
            if base != "debian:12" and base not in stages:
                raise ValueError(f"{path.name}: {base} is neither debian:12 nor an earlier stage")
            current = stages.setdefault(name, [])
        else:
            current.append((word, rest.strip()))
    return stages


def packages_of(text):
    """What the calls of apt-get install in `text` install, in order."""
    text = "\n".join(joined(text))
    return [word for call in re.findall(r"apt-get install ([^&\n]*)", text) for word in call.split() if not word.startswith("-")]


def packages(steps):
    return packages_of("\n".join(text for word, text in steps if word == "RUN"))


def cmake_calls(texts):
    """The calls of cmake in the given shell texts."""
    return [" ".join(call.split()) for text in texts for line in joined(text) for call in re.findall(r"(?:^|&&)\s*(cmake [^&]*)", line)]


def read_apptainer(path):
    """{stage: {section: text}} of a definition file."""
    stages, section = {}, None
    for block in re.split(r"^(?=Bootstrap:)", path.read_text(), flags=re.M)[1:]:
        head, *parts = re.split(r"^%(?=\w)", block, flags=re.M)
        fields = dict(re.findall(r"^(\w+): (\S+)$", head, re.M))
        if (fields.get("Bootstrap"), fields.get("From")) != ("docker", "debian:12"):
            raise ValueError(f"{path.name}: a stage from {fields}")
        sections = stages.setdefault(fields["Stage"], {})
        for part in parts:
            title, _, text = part.partition("\n")
            section = title.split()[0]
            if title.split()[1:2] == ["from"] and title.split()[2] not in stages:
                raise ValueError(f"{path.name}: %{title}: there is no such stage")
            sections[section] = text
    return stages


def copy_context(source, target):
    """What .dockerignore lets through, copied; the number of files. The last line that matches a path or a folder above it decides."""
    rules = [line.strip() for line in (source / ".dockerignore").read_text().splitlines() if line.strip() and not line.startswith("#")]

    def ignored(relative):
        verdict = False
        for rule in rules:
            pattern = rule.lstrip("!").removeprefix("**/")
            parts = relative.parts
            above = ["/".join(parts[:n]) for n in range(1, len(parts) + 1)]
            names = parts if rule.lstrip("!").startswith("**/") else above
            if any(fnmatch.fnmatchcase(name, pattern) for name in names):
                verdict = not rule.startswith("!")
        return verdict

    count = 0
    for top in sorted(source.iterdir()):
        if top.name in ("build", "out", ".git"):
            continue
        for path in [top] if top.is_file() else sorted(top.rglob("*")):
            relative = path.relative_to(source)
            if path.is_file() and not ignored(relative):
                (target / relative).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(path, target / relative)
                count += 1
    return count
