// A periodic chain under given tension: the strain is that of one spring.
#include "tasks/statics/box_stress.hpp"
#include "static_case.hpp"
#include "tasks/statics/pseudo_time.hpp"

using namespace bs;

namespace {

struct Box {
  PseudoTime pseudo;
  BoxStress box;
  std::unique_ptr<StaticCase> run;
  explicit Box(OptionTexts texts, double step = 1) {
    run = std::make_unique<StaticCase>(texts, step, 1, [this](TS ts, TSContext& context, Equilibrium& model) {
      PetscFunctionBegin;
      PetscCall(box.begin(model, StaticsSettings{}));
      PetscCall(pseudo.attach(ts, context, model, 1));
      PetscCall(box.attach(ts, context, model, pseudo));
      PetscFunctionReturn(0);
    });
  }
};

}  // namespace

TEST_CASE("a chain under tension stretches as each of its springs does") {
  Box of({{"-bs_lattice_type", "chain"},
          {"-bs_lattice_size", "8"},
          {"-bs_lattice_dim", "1"},
          {"-bs_lattice_periodic", "x"},
          {"-bs_lattice_stiffness", "40"},
          {"-bs_lattice_spacing", "0.5"},
          {"-bs_box_stress", "xx=3"}},
         0.5);
  REQUIRE(of.box.active());
  std::vector<double> strains;
  of.run->on_step = [&](const StepRecord& record) {
    strains.push_back(of.run->model->free_strains(record.time).at(0).strain);
    return PetscErrorCode(0);
  };
  REQUIRE(of.run->solve());
  // tension k (e L) = 3 s at the load factor s
  REQUIRE(strains.size() == 2);
  CHECK(strains[0] == Approx(1.5 / (40 * 0.5)).epsilon(1e-9));
  CHECK(strains[1] == Approx(3 / (40 * 0.5)).epsilon(1e-9));
  CHECK(of.box.corrections() > 0);
  FinalResults found;
  REQUIRE(of.box.confirm(*of.run->model, 1, of.run->state(), &found) == 0);
  CHECK(found.failure.empty());
  // an equilibrium at another strain does not have that stress
  of.run->model->mechanics()->set_free_strains({0.1});
  REQUIRE(of.box.confirm(*of.run->model, 1, of.run->state(), &found) == 0);
  CHECK_FALSE(found.failure.empty());
}

TEST_CASE("without a stress that is given there is nothing to do") {
  Box of({{"-bs_lattice_type", "chain"}, {"-bs_lattice_size", "8"}, {"-bs_lattice_dim", "1"}, {"-bs_lattice_periodic", "x"}});
  CHECK_FALSE(of.box.active());
}
