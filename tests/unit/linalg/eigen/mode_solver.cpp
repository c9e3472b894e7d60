// Free vibrations against LAPACK on the whole matrix, and a chain against its closed form.
#include "linalg/eigen/mode_solver.hpp"
#include <petscblaslapack.h>
#include <cmath>
#include "base/collective.hpp"
#include "options.hpp"
#include "spoken.hpp"
#include "systems/mechanics.hpp"

using namespace bs;

namespace {

/// Eigenvalues, ascending, of the matrix of `form`, which every rank gathers whole.
std::vector<double> all_eigenvalues(const StandardForm& form) {
  MatHandle A, whole;
  REQUIRE(form.assemble(A.out()) == 0);
  REQUIRE(MatCreateRedundantMatrix(A, bs::size_of(PETSC_COMM_WORLD), PETSC_COMM_SELF, MAT_INITIAL_MATRIX, whole.out()) == 0);
  const PetscInt n = form.unknowns();
  std::vector<PetscScalar> dense(static_cast<std::size_t>(n * n));
  for (PetscInt r = 0; r < n; ++r)
    for (PetscInt c = 0; c < n; ++c) REQUIRE(MatGetValues(whole, 1, &r, 1, &c, &dense[static_cast<std::size_t>(c * n + r)]) == 0);
  std::vector<double> values(static_cast<std::size_t>(n));
  std::vector<PetscScalar> work(static_cast<std::size_t>(8 * n));
  PetscBLASInt size = static_cast<PetscBLASInt>(n), room = 8 * size, info = 0;
  LAPACKsyev_("N", "U", &size, dense.data(), &size, values.data(), work.data(), &room, &info);
  REQUIRE(info == 0);
  return values;
}

/// SLEPc while it is needed; PETSc is there already.
struct Slepc {
  Slepc() { REQUIRE(SlepcInitializeNoArguments() == 0); }
  ~Slepc() { (void)SlepcFinalize(); }
};

struct Vibrations {
  Slepc slepc;
  std::unique_ptr<Model> model;
  StandardForm form;
  explicit Vibrations(const OptionTexts& texts) : model(model_of(texts)) {
    Linearisation& lin = model->mechanics()->linearisation();
    REQUIRE(lin.linearise(0, model->initial_state()) == 0);
    REQUIRE(form.create(lin) == 0);
  }
  Modes solve(const ModeRequest& request) {
    ModeSolver solver(form, request);
    Modes out;
    std::string method, why;
    REQUIRE(solver.create(&method) == 0);
    REQUIRE(solver.solve(&out, &why) == 0);
    INFO(method << ": " << why);
    CHECK(why.empty());
    // every pair is one of A, which is multiplied by without a matrix, and no two of them are the same
    VecHandle product;
    REQUIRE(form.create_vector(product.out()) == 0);
    for (std::size_t k = 0; k < out.mode.size(); ++k) {
      PetscReal left = 0, length = 0;
      REQUIRE(form.multiply(out.mode[k].u, product) == 0);
      REQUIRE(VecAXPY(product, -out.mode[k].omega_squared, out.mode[k].u) == 0);
      REQUIRE(VecNorm(product, NORM_2, &left) == 0);
      REQUIRE(VecNorm(out.mode[k].u, NORM_2, &length) == 0);
      CHECK(length == Approx(1).epsilon(1e-12));
      CHECK(left < 1e-6);
      for (std::size_t j = 0; j < k; ++j) {
        PetscScalar along = 0;
        REQUIRE(VecDot(out.mode[j].u, out.mode[k].u, &along) == 0);
        CHECK(std::abs(along) < 1e-8);
      }
    }
    return out;
  }
};

ModeRequest request_of(PetscInt count, int which, int method) {
  ModeRequest request;
  request.count = count;
  request.which = which;
  request.method = method;
  return request;
}

const OptionTexts NET = {{"-bs_lattice_type", "square"},        {"-bs_lattice_size", "5,4"},       {"-bs_lattice_perturbation", "0.1"},
                         {"-bs_lattice_neighbors", "8"},        {"-bs_lattice_fixed", "xmin"},     {"-bs_lattice_stiffness", "7"},
                         {"-bs_lattice_stiff_fraction", "0.3"}, {"-bs_lattice_stiff_factor", "5"}, {"-bs_lattice_rest_length_factor", "0.98"}};

}  // namespace

TEST_CASE("modes are LAPACK's, by every solver and from both ends of the spectrum") {
  Vibrations net(NET);
  const std::vector<double> all = all_eigenvalues(net.form);
  REQUIRE(all.size() == 32);
  for (const int method : {ModeRequest::dense, ModeRequest::direct, ModeRequest::iterative})
    for (const int which : {ModeRequest::smallest, ModeRequest::largest}) {
      const Modes found = net.solve(request_of(6, which, method));
      INFO("method " << method << ", which " << which);
      REQUIRE(found.mode.size() == 6);
      const std::size_t first = which == ModeRequest::smallest ? 0 : all.size() - 6;
      for (std::size_t k = 0; k < 6; ++k) CHECK(found.mode[k].omega_squared == Approx(all[first + k]).epsilon(1e-8).margin(1e-8));
    }
  ModeRequest near = request_of(4, ModeRequest::target, ModeRequest::direct);
  near.near = 0.5 * (all[12] + all[13]);
  const Modes found = net.solve(near);
  REQUIRE(found.mode.size() == 4);
  std::vector<double> nearest = all;
  std::sort(nearest.begin(), nearest.end(), [&](double a, double b) { return std::abs(a - near.near) < std::abs(b - near.near); });
  nearest.resize(4);
  std::sort(nearest.begin(), nearest.end());
  for (std::size_t k = 0; k < 4; ++k) CHECK(found.mode[k].omega_squared == Approx(nearest[k]).epsilon(1e-8));
  CHECK(found.completeness == Completeness::counted);
}

TEST_CASE("a free chain moves as a whole without stiffness, and its modes are those of the closed form") {
  // omega^2 = 4 k/m sin^2(pi j/(2 n)), j = 0 ... n - 1
  constexpr int N = 9;
  Vibrations chain({{"-bs_lattice_type", "chain"},
                    {"-bs_lattice_size", "9"},
                    {"-bs_lattice_dim", "1"},
                    {"-bs_lattice_stiffness", "6"},
                    {"-bs_lattice_particle_mass", "2"}});
  for (const int method : {ModeRequest::dense, ModeRequest::direct}) {
    const Modes found = chain.solve(request_of(5, ModeRequest::smallest, method));
    CHECK(found.rigid == 1);
    CHECK(found.unstable == 0);
    REQUIRE(found.mode.size() == 5);
    for (int j = 1; j <= 5; ++j)
      CHECK(found.mode[static_cast<std::size_t>(j - 1)].omega_squared == Approx(12 * std::pow(std::sin(M_PI * j / (2.0 * N)), 2)).epsilon(1e-9));
  }
}
