// The closing report and the lines a person sees.
#include <catch2/catch.hpp>

#include <unistd.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "output/progress.hpp"
#include "output/report.hpp"
#include "spoken.hpp"

using namespace bs;

TEST_CASE("the report is JSON with ordered keys") {
  Report report, inner;
  inner.set("a", 1);
  report.set("name", "say \"no\"\n\x01\\");
  report.set("ok", true);
  report.set("steps", std::int64_t(1) << 53);
  report.set("inner", inner);
  report.set("time", 0.1);
  report.set("list", std::vector<double>{1, std::nan(""), -INFINITY});
  report.set("name", std::string("caf\xc3\xa9 \xff"));  // replaced in its place; the last byte is no UTF-8
  REQUIRE(report.json() ==
          "{\n  \"name\": \"caf\xc3\xa9 ?\",\n  \"ok\": true,\n  \"steps\": 9007199254740992,\n"
          "  \"inner\": {\n    \"a\": 1\n  },\n  \"time\": 0.10000000000000001,\n  \"list\": [1, null, null]\n}");
  REQUIRE(json_string("say \"no\"\n\x01\\") == "\"say \\\"no\\\"\\u000a\\u0001\\\\\"");
  REQUIRE(Report().json() == "{}");
}

TEST_CASE("the report appears under its name only when it is complete") {
  const Handled handled;
  long pid = getpid();
  MPI_Bcast(&pid, 1, MPI_LONG, 0, PETSC_COMM_WORLD);
  const std::string file = "/tmp/backspring_" + std::to_string(pid) + ".json";
  Report report;
  report.set("ok", false);
  REQUIRE(report.write(PETSC_COMM_WORLD, file, false) == 0);
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  REQUIRE(text.str() == report.json() + "\n");
  REQUIRE(access((file + ".tmp").c_str(), F_OK) != 0);
  MPI_Barrier(PETSC_COMM_WORLD);
  if (rank_of(PETSC_COMM_WORLD) == 0) unlink(file.c_str());
  Caught said;
  REQUIRE(report.write(PETSC_COMM_WORLD, "/proc/nowhere/r.json", false) == ERR_FAILED);
  REQUIRE(last_error(PETSC_COMM_WORLD).exit == Exit::io);
  REQUIRE((said.text().find("cannot write the report /proc/nowhere/r.json", false) != std::string::npos) == (rank_of(PETSC_COMM_WORLD) == 0));
  REQUIRE(report.write(PETSC_COMM_WORLD, "", false) == 0);
}

TEST_CASE("durations") {
  REQUIRE(duration(0.4211) == "0.42 s");
  REQUIRE(duration(59.4) == "59 s");
  REQUIRE(duration(59.6) == "1 min 00 s");
  REQUIRE(duration(65) == "1 min 05 s");
  REQUIRE(duration(3 * 3600 + 7 * 60) == "3 h 07 min");
  REQUIRE(duration(2 * 86400 + 4 * 3600 + 59) == "2 d 04 h");
  REQUIRE(duration(std::nan("")) == "?");
}

TEST_CASE("progress and verdict lines") {
  RunState state;
  state.start = 1;
  state.time = 1;
  state.end = 3;
  REQUIRE(std::isnan(time_left(state, 5)));
  state.time = 1.5;  // a quarter in 5 s: 15 s are left
  state.steps = 10;
  state.newton = 21;
  state.krylov = 84;
  REQUIRE(time_left(state, 5) == Approx(15));
  REQUIRE(progress_line(state, 5) == "t = 1.5 s (25 %), step 10, Newton 21, Krylov 84, 15 s left");
  state.time = 2.9999;
  state.energy = -1.25;
  state.observed = state.time;
  state.rejected = 2;
  REQUIRE(progress_line(state, 5).find("(99 %)") != std::string::npos);
  REQUIRE(progress_line(state, 5).find(", rejected 2, E = -1.25 J, ") != std::string::npos);
  state.observed = 2.5;
  REQUIRE(progress_line(state, 5).find(", E = -1.25 J at 2.5 s, ") != std::string::npos);
  state.clock = "load factor";
  REQUIRE(progress_line(state, 5).find(", E = -1.25 J at 2.5, ") != std::string::npos);
  state.clock = nullptr;
  state.time = 3;
  REQUIRE(progress_line(state, 5).find("left") == std::string::npos);
  REQUIRE(verdict_line(state, 1.5, "ok") == "backspring: ok t=3 steps=10 rejected=2 newton=21 krylov=84 wall=1.500");
  REQUIRE(verdict_line(state, 1.5, "failed").rfind("backspring: failed t=3 ", 0) == 0);
  state.warnings = 1;
  REQUIRE(verdict_line(state, 1.5, "ok") == "backspring: ok t=3 steps=10 rejected=2 newton=21 krylov=84 wall=1.500 warnings=1");
}

TEST_CASE("a plain line a step, and only the verdict where it is quiet") {
  const bool first = rank_of(PETSC_COMM_WORLD) == 0;
  RunState state;
  state.end = 1;
  Caught every(stdout);
  let_runs_print(PETSC_COMM_WORLD);
  Progress progress(PETSC_COMM_WORLD, 0);
  progress.update(state);
  progress.update(state);
  progress.finish(state, "ok", {"summary"});
  std::istringstream lines(every.text());
  int count = 0;
  std::string line, last;
  while (std::getline(lines, line)) {
    ++count;
    last = line;
  }
  REQUIRE(count == (first ? 4 : 0));
  if (first) REQUIRE(last.rfind("backspring: ok t=0 steps=0 ", 0) == 0);
  Caught quiet(stdout);
  Progress silent(PETSC_COMM_WORLD, -1);
  silent.update(state);
  silent.finish(state, "failed", {});
  const std::string said = quiet.text();
  REQUIRE((said.rfind("backspring: failed ", 0) == 0) == first);
}
