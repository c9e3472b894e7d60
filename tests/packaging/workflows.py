"""The workflows of public CI: what they call exists, their groups of tests are all that there are, the README's badges point to them."""
import itertools
import re
import subprocess

import docker
import project
import yaml

FOLDER = project.REPO / ".github/workflows"
USES = {"actions/checkout@v4", "actions/upload-artifact@v4", "actions/download-artifact@v4"}
EXPRESSION = re.compile(r"\$\{\{ (matrix\.(\w+)|[\w.]+) \}\}")


def rows(job):
    """The entries of a job's matrix."""
    return job.get("strategy", {}).get("matrix", {}).get("include", [{}])


def filled(text, row):
    """`text` with the row's words in the place of ${{ matrix.NAME }}; a word that the row lacks is an error."""
    return EXPRESSION.sub(lambda m: str(row[m[2]]) if m[2] else "X", str(text))


def commands():
    """(workflow, job, script) of every step that runs something, for every row of its matrix, in which it is not left out."""
    for path in sorted(FOLDER.glob("*.yml")):
        flow = yaml.safe_load(path.read_text())
        for name, job in flow["jobs"].items():
            for row, step in itertools.product(rows(job), job["steps"]):
                if "run" in step and not left_out(step.get("if"), row):
                    yield path.stem, name, filled(step["run"], row)


def left_out(condition, row):
    if not condition:
        return False
    name, sign, value = re.fullmatch(r"matrix\.(\w+) (==|!=) '([^']*)'", condition).groups()
    return (row[name] == value) != (sign == "==")


def selected(build, arguments):
    """Names of the tests that ctest selects with these arguments."""
    done = subprocess.run(f"ctest --test-dir {build} -N {arguments}", shell=True, capture_output=True, text=True, check=True)
    return set(re.findall(r"^\s*Test\s+#\d+: (\S+)", done.stdout, re.M))


def check_calls(checks):
    for path in sorted(FOLDER.glob("*.yml")):
        flow = yaml.safe_load(path.read_text())
        uses = {step["uses"] for job in flow["jobs"].values() for step in job["steps"] if "uses" in step}
        checks.true(f"{path.name}: name and actions", flow["name"] == path.stem and uses <= USES and "actions/checkout@v4" in uses, f"{flow['name']} {sorted(uses - USES)}")
        checks.true(f"{path.name}: may only read", flow["permissions"] == {"contents": "read"})
        for word in re.findall(r"^\s+paths: \[(.*)\]", path.read_text(), re.M):
            lost = [glob for glob in re.findall(r"[^\s,\"]+", word) if not list(project.REPO.glob(glob))]
            checks.true(f"{path.name}: the paths that it watches exist", not lost, f"{lost}")
    wrong, scripts = [], list(commands())
    for flow, job, script in scripts:
        done = subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True)
        wrong += [f"{flow}/{job}: {done.stderr}"] if done.returncode else []
        wrong += [f"{flow}/{job}: {text}" for text in project.wrong_calls(docker.cmake_calls([script]))]
        wrong += [f"{flow}/{job}: no test preset {name}" for name in re.findall(r"ctest --preset (\S+)", script) if name not in project.presets("test")]
        wrong += [f"{flow}/{job}: no {name}" for name in re.findall(r"(?:^|[ '])((?:\.ci|src|tests|options)/[\w./-]+)", script) if not (project.REPO / name).exists()]
    checks.true(f"workflows: {len(scripts)} steps call what exists", len(scripts) > 30 and not wrong, f"{wrong[:3]}")


def check_groups(checks, build):
    everything, groups = selected(build, ""), set()
    for flow, job, script in commands():
        for arguments in re.findall(r"ctest --(?:test-dir|preset) \S+ (.*)", script):
            found = selected(build, re.sub(r"--(no-tests=error|output-on-failure|parallel \d+)", "", arguments))
            checks.true(f"{flow}/{job}: ctest {arguments[-60:]}", len(found) > 0, f"{len(found)} tests")
            groups |= found if (flow, job) == ("tests", "group") else set()
    checks.true("the groups of tests.yml are all tests", groups == everything and len(everything) > 100, f"{sorted(everything ^ groups)[:5]}")


def check_badges(checks):
    badges = re.findall(r"\[!\[(\w+)\]\(\.\./\.\./actions/workflows/(\w+)\.yml/badge\.svg\)\]\(\.\./\.\./actions/workflows/(\w+)\.yml\)", (project.REPO / "README.md").read_text())
    named = {path.stem for path in FOLDER.glob("*.yml")}
    checks.true("the README has a badge of each workflow", {badge[0] for badge in badges} == named and all(len(set(badge)) == 1 for badge in badges), f"{badges}")


def check_forms(checks):
    """The forms of issues: a fault comes with the report, whose option exists."""
    known = set(re.findall(r"`(-bs_\w+)`", (project.REPO / "options/reference/README.md").read_text()))
    for path in sorted((project.REPO / ".github/ISSUE_TEMPLATE").glob("*.yml")):
        form = yaml.safe_load(path.read_text())
        if path.stem == "config":
            continue
        fields = {field["id"]: field for field in form["body"]}
        options = set(re.findall(r"-bs_\w+", path.read_text()))
        checks.true(f"{path.name}: a form that asks for the report", {"name", "description"} <= set(form) and fields["report"]["attributes"]["render"] == "json" and options and options <= known,
                    f"{sorted(options)}")


def check(checks, build):
    check_calls(checks)
    check_groups(checks, build)
    check_badges(checks)
    check_forms(checks)
