#!/usr/bin/env python3
"""Runs the fuzzers of the text readers: bytes that no reader may crash on, hang on or misjudge.

  run.py --build FOLDER [--seconds 30] [--reader xsp] [--corpus FOLDER]

Builds tests/fuzz with clang++ in FOLDER, then gives every reader its part of `seconds`, starting from seeds/. With
--corpus, what was found interesting is kept there for the next run. An input that breaks a reader is printed and left in
FOLDER: it belongs into seeds/ with the fix.
Ends with "N passed, N failed, N skipped"; exit code 77 if clang++ cannot build fuzzers here.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
READERS = ["xsp", "matrix_market", "csv_table", "waveform"]
LIMITS = ["-timeout=60", "-rss_limit_mb=1024", "-malloc_limit_mb=256", "-max_len=4096", "-print_final_stats=1"]


def skip(why):
    print(f"{why}: apt install clang libclang-rt-dev\n0 passed, 0 failed, {len(READERS)} skipped")
    return 77


def can_fuzz(compiler):
    """Whether the compiler has libFuzzer and the sanitizers' libraries."""
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "empty.cpp"
        source.write_text('#include <cstddef>\nextern "C" int LLVMFuzzerTestOneInput(const unsigned char*, std::size_t) { return 0; }\n')
        return subprocess.run([compiler, "-fsanitize=fuzzer,address,undefined", source, "-o", source.with_suffix("")],
                              capture_output=True).returncode == 0


def build(compiler, folder):
    environment = dict(os.environ, CXX=compiler)
    subprocess.run(["cmake", "-S", HERE, "-B", folder, "-G", "Ninja"], env=environment, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder], env=environment, check=True, stdout=subprocess.DEVNULL)


def fuzz(reader, folder, seconds, corpus):
    """Runs one fuzzer; returns whether it held, and what it said."""
    work = folder / "found" / reader
    work.mkdir(parents=True, exist_ok=True)
    command = [folder / f"fuzz_{reader}"] + ([corpus / reader] if corpus else []) + [HERE / "seeds" / reader]
    if corpus:
        (corpus / reader).mkdir(parents=True, exist_ok=True)
    else:  # new inputs go to the first folder: not into the seeds
        command.insert(1, tempfile.mkdtemp(dir=work))
    command += [f"-dict={HERE / 'dictionaries' / reader}.dict", f"-max_total_time={seconds}", f"-artifact_prefix={work}/", *LIMITS]
    try:
        done = subprocess.run(command, capture_output=True, timeout=seconds + 60)
    finally:
        if not corpus:
            shutil.rmtree(command[1], ignore_errors=True)
    return done.returncode == 0, done.stderr.decode(errors="replace")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", required=True, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--seconds", type=int, default=30, help="of all readers together")
    parser.add_argument("--reader", choices=READERS, action="append")
    parser.add_argument("--corpus", type=lambda path: pathlib.Path(path).resolve())
    arguments = parser.parse_args()

    compiler = shutil.which("clang++")
    if not compiler:
        return skip("no clang++, which the fuzzers need")
    if not can_fuzz(compiler):
        return skip("clang++ lacks the libraries of its sanitizers")
    build(compiler, arguments.build)
    chosen = arguments.reader or READERS
    failed = 0
    for reader in chosen:
        held, said = fuzz(reader, arguments.build, max(1, arguments.seconds // len(chosen)), arguments.corpus)
        count = [line.split()[-1] for line in said.splitlines() if "number_of_executed_units" in line]
        print(f"{'ok  ' if held else 'FAIL'} {reader}: {count[0] if count else '?'} inputs")
        if not held:
            failed += 1
            print("\n".join("       " + line for line in said.splitlines()[-60:]))
    print(f"{len(chosen) - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
