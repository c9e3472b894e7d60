// The energy search on potentials of one velocity whose minima, slopes and rounding errors are known.
#include "solvers/newton/search/energy.hpp"
#include <functional>
#include <limits>
#include "small_model.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

constexpr double SIGMA = 4;

/// F_x = sigma x - v, F_v = Phi'(v): mass 1, x = v/sigma where F_x = 0. On several ranks each has the same v, and Phi is the sum over them.
class Well final : public SmallModel, public Incremental {
 public:
  std::function<double(double)> phi, slope;
  double noise = 0, floor = 1e-15;  ///< rounding errors of a change of Phi, and of F_v
  int asked = 0;                    ///< how often Phi was
  bool potential = true;
  double most = std::numeric_limits<double>::infinity();  ///< the largest lambda that forces allow

  Well(std::function<double(double)> f, std::function<double(double)> df)
      : SmallModel({0, 0}, 2), phi(std::move(f)), slope(std::move(df)), ranks_(size_of(PETSC_COMM_WORLD)) {}
  std::vector<double> rates(double, const std::vector<double>&) const override { return {0, 0}; }
  PetscErrorCode residual(double, Vec y, Vec, Form, Vec F) override {
    const std::vector<double> s = get(y);
    set(F, {SIGMA * s[0] - s[1], slope(s[1])});
    return 0;
  }
  PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) override {
    const std::vector<double> f = get(F);
    *norms = {std::sqrt(ranks_) * std::abs(f[0]), std::sqrt(ranks_) * std::abs(f[1])};
    return 0;
  }
  PetscErrorCode residual_floor(double, Vec, double, Form, ResidualNorms* out) override {
    *out = {1e-15, floor};
    return 0;
  }
  Incremental* incremental() override { return potential ? this : nullptr; }
  std::string lacks_potential() const override { return lack; }
  PetscErrorCode add_kinematic(Vec F, Vec y) override {
    std::vector<double> s = get(y);
    s[1] += get(F)[0];
    set(y, s);
    return 0;
  }
  PetscErrorCode follow(Vec y, Vec z) override {
    v_ = get(y)[1];
    dv_ = get(z)[1];
    return 0;
  }
  PetscErrorCode beyond_slope(double, double, double lambda, PotentialChange* change) override {
    ++asked;
    change->value = ranks_ * (phi(v_ + lambda * dv_) - phi(v_) - lambda * slope(v_) * dv_);
    change->noise = noise;
    return 0;
  }
  bool limits_steps() const override { return most < std::numeric_limits<double>::infinity(); }
  PetscErrorCode largest_lambda(double, double* lambda) override {
    *lambda = most;
    return 0;
  }
  std::string lack;

 private:
  double ranks_, v_ = 0, dv_ = 0;
};

PetscErrorCode form(SNES, Vec y, Vec F, void* well) { return static_cast<Well*>(well)->residual(0, y, nullptr, Form::momentum, F); }

/// A solver that stands at v, x = v/sigma, with the search of the program.
struct Search {
  Well& well;
  SNESHandle snes;
  VecHandle y, F, Y, W, G;
  NewtonPolicy newton;
  SNESLineSearch line = nullptr;
  EnergyLimits limits;

  explicit Search(Well& w) : well(w) {
    limits.full_step = 0;
    REQUIRE(register_searches() == 0);
    REQUIRE(SNESCreate(PETSC_COMM_WORLD, snes.out()) == 0);
    for (VecHandle* vec : {&y, &F, &Y, &W, &G}) REQUIRE(VecDuplicate(well.initial_state(), vec->out()) == 0);
    REQUIRE(SNESSetFunction(snes, F, form, &well) == 0);
    NewtonSettings settings;
    settings.model = &well;
    settings.affine = true;
    settings.step = [this](NewtonStep* step) {
      *step = {0, 1 / SIGMA, y};
      return 0;
    };
    REQUIRE(newton.attach(snes, settings) == 0);
    newton.stage.sigma = SIGMA;
    REQUIRE(newton.estimate_floor(SIGMA) == 0);
    REQUIRE(SNESGetLineSearch(snes, &line) == 0);
    for (Vec owned : {W.get(), G.get()}) REQUIRE(PetscObjectReference(reinterpret_cast<PetscObject>(owned)) == 0);  // the search destroys them
    REQUIRE(SNESLineSearchSetVecs(line, y, F, Y, W, G) == 0);
  }
  /// The search from v along dv (Newton's direction is -dv) in iteration `iteration`; returned is lambda, NaN where it fails.
  double from(double v, double dv, PetscInt iteration = 0) {
    Well::set(y, {v / SIGMA, v});
    Well::set(Y, {-dv / SIGMA, -dv});
    return again(iteration);
  }
  double again(PetscInt iteration) {
    PetscReal norm = 0, lambda = 0;
    SNESLineSearchReason reason;
    REQUIRE(SNESComputeFunction(snes, y, F) == 0);
    REQUIRE(SNESSetIterationNumber(snes, iteration) == 0);
    REQUIRE(VecNorm(F, NORM_2, &norm) == 0);
    REQUIRE(SNESLineSearchSetNorms(line, 0, norm, 0) == 0);
    REQUIRE(energy_search(line, newton, limits) == 0);
    REQUIRE(SNESLineSearchGetReason(line, &reason) == 0);
    REQUIRE(SNESLineSearchGetLambda(line, &lambda) == 0);
    return reason == SNES_LINESEARCH_SUCCEEDED ? lambda : std::nan("");
  }
  double x() const { return Well::get(y)[0]; }
  double v() const { return Well::get(y)[1]; }
};

Well parabola() {
  return {[](double v) { return 5 * v * v; }, [](double v) { return 10 * v; }};
}

constexpr double NONE = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("no step is longer than forces allow", "[energy_search]") {
  for (const bool guarded : {false, true}) {
    for (const double full_step : {0.0, 0.1}) {
      Well well = parabola();
      if (guarded) well.lack = "it";
      well.most = 0.25;
      Search search(well);
      search.limits.full_step = full_step;
      CHECK(search.from(1, -1) == 0.25);
      CHECK(search.v() == 0.75);
      well.most = 3;
      CHECK(search.from(1, -1) == 1);
      well.most = 0;
      CHECK(std::isnan(search.from(1, -1)));
    }
  }
  // a short step is lengthened to where they allow, by powers of two
  Well far = parabola();
  Search search(far);
  CHECK(search.from(1, -0.01) > 16);
  far.most = 10;
  CHECK(search.from(1, -0.01) == 8);
}

TEST_CASE("a full step that lowers Phi is taken", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  CHECK(search.from(1, -1) == 1);
  CHECK(search.v() == 0);
  CHECK(search.x() == 0);
  CHECK(SmallModel::get(search.F)[1] == 0);  // the residual is of the new iterate
  CHECK(search.newton.search.cuts == 0);
}

TEST_CASE("a step that is too long ends in the minimum of the parabola", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  CHECK(search.from(1, -3) == Approx(1.0 / 3).epsilon(1e-14));
  CHECK(search.v() == Approx(0).margin(1e-14));
  CHECK(search.newton.search.cuts == 1);
  // a tenth of the trial before at the least: 1, 0.1, then 1/40
  search.limits.order = 2;
  CHECK(search.from(1, -40) == Approx(1.0 / 40).epsilon(1e-12));
  CHECK(search.newton.search.cuts == 3);
}

TEST_CASE("two trials make a cubic, whose minimum is found exactly", "[energy_search]") {
  Well well([](double v) { return v * v * v / 3 - v; }, [](double v) { return v * v - 1; });
  Search search(well);
  CHECK(search.from(0, 25) == Approx(0.04).epsilon(1e-12));
  CHECK(search.v() == Approx(1).epsilon(1e-12));
  search.limits.order = 2;  // the parabola through the last trial alone
  CHECK(search.from(0, 25) == Approx(0.5 * 25 * 0.01 / (2.5 * 2.5 * 2.5 / 3)).epsilon(1e-12));
}

TEST_CASE("Phi must fall by alpha of its slope", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  CHECK(search.from(1, -1.5) == 1);
  search.limits.alpha = 0.26;  // a parabola's full step of c times that to its minimum falls by (1 - c/2) of the slope
  CHECK(search.from(1, -1.5) == 0.5);
  search.limits.alpha = 0.24;
  CHECK(search.from(1, -1.5) == 1);
}

TEST_CASE("a change of Phi within its rounding errors is judged by the slope at the trial", "[energy_search]") {
  // near its minimum Phi is computed too high by 1e-6 wherever it differs from the start
  Well well([](double v) { return 5 * v * v + (v < 0.9e-4 ? 1e-6 : 0); }, [](double v) { return 10 * v; });
  Search search(well);
  search.limits.most = 3;
  CHECK_FALSE(search.from(1e-4, -1e-4) == 1);
  well.noise = 1e-5;
  CHECK(search.from(1e-4, -1e-4) == 1);
  CHECK(search.v() == Approx(0).margin(1e-18));
  // uphill again at the trial, as steeply as it was downhill: too long
  const double lambda = search.from(1e-4, -3e-4);
  CHECK((lambda >= 0.1 && lambda <= 0.5));
}

TEST_CASE("a direction whose slope is a rounding error is taken", "[energy_search]") {
  Well well = parabola();
  well.floor = 20;
  Search search(well);
  CHECK(search.from(1, -3) == 1);
  CHECK(search.v() == -2);
  CHECK(well.asked == 0);
}

TEST_CASE("states in which a law has no value are stepped back from", "[energy_search]") {
  Well well([](double v) { return v < -1 ? NONE : 5 * v * v; }, [](double v) { return v < -1 ? NONE : 10 * v; });
  Search search(well);
  CHECK(search.from(1, -3) == 0.5);
  // Phi has a value there, the force has none
  Well other([](double v) { return v; }, [](double v) { return v < -1 ? NONE : 1; });
  Search second(other);
  CHECK(second.from(0, -3) == 0.25);
}

TEST_CASE("beside a saddle a step is doubled while Phi falls", "[energy_search]") {
  const auto phi = [](double v) { return v * v * v * v / 4 - v * v / 2; };
  Well well(phi, [](double v) { return v * v * v - v; });
  Search search(well);
  double expected = 1;
  while (phi(0.01 + 0.02 * expected) < phi(0.01 + 0.01 * expected)) expected *= 2;
  CHECK(expected > 16);
  CHECK(search.from(0.01, 0.01) == expected);
  CHECK(search.v() == Approx(0.01 + 0.01 * expected).epsilon(1e-15));
  CHECK(search.x() == Approx(search.v() / SIGMA).epsilon(1e-15));
  CHECK(search.from(1e-6, 1e-6) == 4096);  // twelve times at most
  // no further than the forces have values
  well.slope = [](double v) { return v > 0.3 ? NONE : v * v * v - v; };
  CHECK(search.from(0.01, 0.01) == 1);
  CHECK(search.v() == Approx(0.02).epsilon(1e-15));
  // a step to a minimum is left alone
  Well flat = parabola();
  Search second(flat);
  CHECK(second.from(1, -0.5) == 1);
}

TEST_CASE("a full step that leaves little of the residual needs no energy", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  search.limits.full_step = 0.1;
  CHECK(search.from(1, -0.95) == 1);
  CHECK(well.asked == 0);
  CHECK(search.from(1, -0.8) == 1);
  CHECK(well.asked > 0);
  well.asked = 0;
  search.limits.full_step = 0;
  CHECK(search.from(1, -0.95) == 1);
  CHECK(well.asked > 0);
}

TEST_CASE("the search ends where no trial lowers Phi", "[energy_search]") {
  Well well([](double v) { return -v; }, [](double) { return 1.0; });  // no gradient of anything
  Search search(well);
  search.limits.most = 5;
  CHECK(std::isnan(search.from(0, -1)));
  CHECK(search.newton.search.cuts == 5);
  CHECK(search.v() == 0);  // the iterate stays
  search.limits = {1e-4, 1, 0.2};
  search.limits.full_step = 0;
  CHECK(std::isnan(search.from(0, -1)));
  CHECK(search.newton.search.cuts == 7);  // 1 and 1/4
}

TEST_CASE("Phi may rise to its highest value at the last iterates", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  const double ranks = size_of(PETSC_COMM_WORLD), c = 1 + std::sqrt(2.0);  // Phi rises by 5 on every rank
  search.newton.search.past.moved(-7 * ranks);
  CHECK(search.from(1, -c, 1) == 1);
  CHECK(search.newton.search.past.highest() == Approx(2 * ranks).epsilon(1e-12));
  CHECK(search.from(1, -c, 1) < 1);
  search.newton.search.past.moved(-7 * ranks);
  CHECK(search.from(1, -c, 0) < 1);  // the first iterate has none before it
}

TEST_CASE("uphill directions are searched by residual norms, the fifth of them is given up", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  for (int k = 1; k <= 4; ++k) {
    CHECK(search.from(1, 1, k) == 1);
    CHECK(search.newton.search.uphill == k);
  }
  CHECK(std::isnan(search.from(1, 1, 5)));
  CHECK(search.from(1, 1, 0) == 1);  // of the next solve
}

TEST_CASE("the line is that of states with F_x = 0", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  // at (0.5, 1) sigma x is 2: the line begins at v = 2. Newton's step leads to x = -1, v = -4
  SmallModel::set(search.y, {0.5, 1});
  SmallModel::set(search.Y, {1.5, 5});
  CHECK(search.again(1) == Approx(1.0 / 3).epsilon(1e-14));
  CHECK(search.v() == Approx(0).margin(1e-14));
  CHECK(search.x() == Approx(0).margin(1e-14));
  // a full step is Newton's own
  SmallModel::set(search.y, {0.5, 1});
  SmallModel::set(search.Y, {0.45, 0.8});
  CHECK(search.again(1) == 1);
  CHECK(search.x() == 0.5 - 0.45);
  CHECK(search.v() == 1 - 0.8);
}

TEST_CASE("what has no potential is searched by residual norms", "[energy_search]") {
  Well well = parabola();
  Search search(well);
  CHECK(lacks_energy(search.newton.settings()).empty());
  well.lack = "friction";
  CHECK(lacks_energy(search.newton.settings()) == "friction");
  CHECK(search.from(1, -3, 3) == 1);  // of the first iterations full steps
  // then phi^2's parabola from its slope: 1/(2^2 - 1 + 2)
  CHECK(search.from(1, -3, 10) == Approx(0.2).epsilon(1e-14));
  well.lack = "";
  search.newton.stage.time = 1;  // the Jacobian is of another stage
  CHECK(search.from(1, -3, 10) == Approx(0.2).epsilon(1e-14));
  CHECK(well.asked == 0);
  NewtonSettings settings = search.newton.settings();
  settings.affine = false;
  CHECK(lacks_energy(settings) == "this -ts_type");
  well.potential = false;
  CHECK(lacks_energy(search.newton.settings()) == "this system");
}
