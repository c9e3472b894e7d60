// Three parallel springs that hold a weight: the stiffest breaks, the others take its load, or break in turn.
#include "tasks/statics/avalanche.hpp"
#include "static_case.hpp"
#include "systems/system.hpp"
#include "tasks/statics/statics.hpp"

using namespace bs;

namespace {

struct Bundle {
  PseudoTime pseudo;
  std::unique_ptr<Avalanche> avalanche;
  std::unique_ptr<StaticCase> run;
  std::string failure;
  int calls = 0, frames = 0;
  bool found = false;

  /// Springs of stiffness 3, 1, 1 that bear `limit` each, and the weight 1.8.
  Bundle(const std::string& limit, OptionTexts texts = {}) {
    texts.insert({{"-bs_lattice_file", scene_file("unit_bundle.xsp",
                                                  "#1.0\nmass 1 0 20 0 0 -1 1\nmass 2 0 10 0 0 1 1\nspng 1 1 2 3 0 10\nspng 2 1 2 1 0 10\n"
                                                  "spng 3 1 2 1 0 10\n")},
                  {"-bs_gravity", "0,-1.8"},
                  {"-bs_break_force", limit}});
    run = std::make_unique<StaticCase>(texts, 1, 1, [this](TS ts, TSContext& context, Equilibrium& model) {
      PetscFunctionBegin;
      PetscCall(pseudo.attach(ts, context, model, 1));
      StaticsSettings settings;
      PetscCall(read_statics_settings(PETSC_COMM_WORLD, Analyses::none, &settings));
      avalanche = std::make_unique<Avalanche>(model, pseudo, settings.avalanche);
      PetscFunctionReturn(0);
    });
    run->stepper->set_after_break([this](double time, Vec y, const Avalanche::Frame&, bool* good, std::string* why) {
      ++calls;
      PetscErrorCode code = avalanche->follow_to_rest(
          time, y,
          [this](Vec) {
            ++frames;
            return avalanche->moving() ? 0 : PETSC_ERR_PLIB;
          },
          good, why);
      found = *good;
      failure = *why;
      return code;
    });
  }
  double released() {
    std::vector<Observable> all;
    REQUIRE(run->model->observe(1, run->state(), &all) == 0);
    for (const Observable& one : all)
      if (one.name == "released_energy") return one.value[0];
    return -1;
  }
};

}  // namespace

TEST_CASE("after a break the load goes to the other springs") {
  Bundle bundle("1");  // of the load 1.8 the stiffest takes 1.08, then the others 0.9 each
  REQUIRE(bundle.run->solve());
  CHECK(bundle.calls == 1);
  CHECK(bundle.found);
  CHECK(bundle.run->place(1) == Approx(10 - 0.9).epsilon(1e-10));
  std::vector<Dataset> events;
  REQUIRE(bundle.run->model->breaks()->tables(&events) == 0);
  if (rank_of(PETSC_COMM_WORLD) == 0) {
    for (const Dataset& table : events)
      if (table.path == "/events/broken/spring") CHECK(std::get<std::vector<std::int64_t>>(table.rows) == std::vector<std::int64_t>{0});
  }
  // what the two whole springs and the weight lose from an extension of 0.36 to one of 0.9
  CHECK(bundle.released() == Approx((0.36 * 0.36 - 1.8 * 0.36) - (0.9 * 0.9 - 1.8 * 0.9)).epsilon(1e-9));
}

// m x'' = -2 (x - 0.9) from x = 0.36 at rest: free of damping it turns back at x = 1.44; with z = x - 0.9 + i v/omega backward Euler has
// z_n = -0.54/(1 + i h omega)^n, of which the real part is 0.043 at most with h omega = 3.
TEST_CASE("in motion springs break that would bear the load at rest, unless long steps damp the swing") {
  Bundle swings("1", {{"-bs_break_follow", "dynamics"}, {"-bs_break_dt", "0.02"}});
  CHECK_FALSE(swings.run->solve());
  CHECK(swings.failure.find("at load factor 1 no equilibrium was found after 3 springs had broken") == 0);

  Bundle damped("1", {{"-bs_break_follow", "dynamics"}, {"-bs_break_dt", "2.1213"}, {"-bs_break_output_interval", "1"}});
  REQUIRE(damped.run->solve());
  CHECK(damped.found);
  CHECK(damped.frames > 0);
  CHECK(damped.run->place(1) == Approx(10 - 0.9).epsilon(1e-10));
}

TEST_CASE("a bundle that breaks altogether is lost") {
  Bundle bundle("0.85");
  CHECK_FALSE(bundle.run->solve());
  CHECK_FALSE(bundle.found);
  CHECK(bundle.failure.find("at load factor 1 no equilibrium was found after 3 springs had broken") == 0);
}
