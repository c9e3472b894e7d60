// What a run counts, step by step, over the runs it continues; the one list of reasons for rejections.
#include <catch2/catch.hpp>

#include <set>

#include "output/frame_file.hpp"
#include "time/rejections.hpp"

using namespace bs;

TEST_CASE("each step's record holds what is new since the one before") {
  StepCounter counter;
  RejectionCounts rejected{};
  StepRecord first, second;
  rejected[LINE_SEARCH] = 2;
  counter.count(5, 40, rejected, &first);
  counter.set_steps(1);
  rejected[LINE_SEARCH] = 3;
  rejected[ERROR_ESTIMATE] = 1;
  counter.count(9, 40, rejected, &second);
  counter.set_steps(2);
  counter.add_shortened();
  REQUIRE(first.newton == 5);
  REQUIRE(first.krylov == 40);
  REQUIRE(first.rejected == 2);
  REQUIRE(second.newton == 4);
  REQUIRE(second.krylov == 0);
  REQUIRE(second.rejected == 2);
  REQUIRE(second.reasons == RejectionCounts{0, 1, 0, 0, 0, 1});
  const RunCounts& all = counter.counts();
  REQUIRE((all.steps == 2 && all.newton == 9 && all.krylov == 40 && all.rejected == 4 && all.shortened == 1));
}

TEST_CASE("a continued run counts on, whatever its solvers have counted before its first step") {
  StepCounter before;
  StepRecord record;
  const RejectionCounts rejected{1, 0, 0, 2, 0, 0};
  before.count(100, 1000, rejected, &record);
  before.set_steps(30);
  Facts facts;
  before.save(&facts);
  REQUIRE(facts.whole == std::map<std::string, std::int64_t>{{"step", 30}, {"rejected", 3}, {"newton", 100}, {"krylov", 1000}, {"shortened", 0}});

  StepCounter after;
  after.restore(facts, 7, 0, rejected);  // 7 iterations of the steps that were repeated to give the method its memory back
  REQUIRE(after.counts().steps == 30);
  after.count(7 + 3, 12, {1, 0, 0, 2, 1, 0}, &record);
  REQUIRE((record.newton == 3 && record.krylov == 12 && record.rejected == 1));
  REQUIRE(record.reasons == RejectionCounts{0, 0, 0, 0, 1, 0});
  REQUIRE((after.counts().newton == 103 && after.counts().krylov == 1012 && after.counts().rejected == 4));
}

TEST_CASE("every reason has a key of its own, words, a sentence and advice") {
  std::set<std::string> keys, words;
  for (const RejectionReason& reason : REJECTION_REASONS) {
    keys.insert(reason.key);
    words.insert(reason.word);
    REQUIRE(std::string(reason.sentence).size() > 10);
    REQUIRE(std::string(reason.advice).rfind("try ", 0) == 0);
  }
  REQUIRE(keys.size() == std::size(REJECTION_REASONS));
  REQUIRE(words.size() == std::size(REJECTION_REASONS));
  REQUIRE(std::string(REJECTION_REASONS[DOMAIN_ERROR].key) == "domain");
  REQUIRE(std::string(REJECTION_REASONS[ERROR_ESTIMATE].key) == "error");
}

TEST_CASE("files name rejections as they always have") {
  REQUIRE(log_columns() == std::vector<std::string>{"step", "time", "dt", "newton", "krylov", "rejected", "rejected_newton", "rejected_line_search",
                                                    "rejected_iterations", "rejected_linear", "rejected_domain", "rejected_error"});
  REQUIRE(in_words({0, 2, 0, 0, 0, 1}) == "2 line search, 1 error estimate");
  REQUIRE(in_words({}).empty());
  REQUIRE(total({1, 2, 3, 4, 5, 6}) == 21);
}
