// Options of the laws, read the way the program reads them.
#include "base/options.hpp"
#include "laws_common.hpp"
#include "physics/body/registry.hpp"
#include "physics/whole/motion.hpp"
#include "physics/whole/xsp_center_of_mass.hpp"
#include "spoken.hpp"

using namespace bs;
using namespace law_tests;

namespace {

/// Reads the law's options while those given are set; the program's message, if any, goes to `said`.
template <class Law>
PetscErrorCode read_law(Law* law, const std::vector<std::pair<const char*, const char*>>& given, std::string* said = nullptr) {
  for (const auto& [name, value] : given) REQUIRE(PetscOptionsSetValue(nullptr, name, value) == 0);
  PetscErrorCode code = 0;
  {
    const Handled handled;
    Caught caught;
    code = read_section(PETSC_COMM_WORLD, Law::title, [&](Section& o) { law->options(o); });
    const std::string text = caught.text();
    if (said) *said = text;
  }
  for (const auto& option : given) REQUIRE(PetscOptionsClearValue(nullptr, option.first) == 0);
  return code;
}

template <class Law>
Law accepted(const std::vector<std::pair<const char*, const char*>>& given) {
  Law law;
  REQUIRE(read_law(&law, given) == 0);
  return law;
}

/// A law has a title; this is none.
struct TitledFluid : DisplacedFluid {
  static constexpr const char* title = "displaced fluid";
};

/// Refused on every rank, and rank 0 says a line that contains `part`.
template <class Law>
void refused(const std::vector<std::pair<const char*, const char*>>& given, const std::string& part) {
  Law law;
  std::string said;
  REQUIRE(read_law(&law, given, &said) == ERR_FAILED);
  INFO("said: " << said);
  if (rank_of(PETSC_COMM_WORLD) == 0) REQUIRE(said.find(part) != std::string::npos);
}

}  // namespace

TEST_CASE("options of the gravity laws") {
  const auto uniform = accepted<UniformGravity>({{"-bs_gravity", "0,0,-9.81"}});
  REQUIRE((uniform.active() && uniform.g[0] == 0 && uniform.g[2] == -9.81));
  REQUIRE(uniform.describe() == "uniform gravity g = (0, 0, -9.81) m/s^2");
  REQUIRE(accepted<UniformGravity>({{"-bs_gravity", "9.8"}}).describe() == "uniform gravity g = (9.8) m/s^2");
  const auto central = accepted<Several<CentralGravity>>({{"-bs_central_M0", "5e24"}, {"-bs_central_point", "1,2"}}).all.front();
  REQUIRE((central.active() && central.M0 == 5e24 && central.G == 6.6743e-11 && central.x0[1] == 2));
  const std::vector<CentralGravity> none = accepted<Several<CentralGravity>>({}).all;
  REQUIRE((none.size() == 1 && !none.front().active()));
  const std::vector<CentralGravity> two =
      accepted<Several<CentralGravity>>(
          {{"-bs_central_M0_Sun", "3"}, {"-bs_central_point_SUN", "1,2"}, {"-bs_central_m0_moon", "4"}, {"-bs_central_G", "2"}})
          .all;
  REQUIRE((two.size() == 3 && !two[0].active()));
  REQUIRE((two[1].M0 == 4 && two[1].G == 2 && two[1].x0[0] == 0 && two[2].M0 == 3 && two[2].G == 2 && two[2].x0[1] == 2));
  refused<Several<CentralGravity>>({{"-bs_central_point_sun", "1"}}, "-bs_central_M0_sun");
  refused<Several<CentralGravity>>({{"-bs_central_M0_sun", "-1"}}, "-bs_central_M0_sun");
  refused<Several<CentralGravity>>({{"-bs_central_G", "1"}}, "-bs_central_M0");
  refused<Several<CentralGravity>>({{"-bs_central_M0", "-1"}}, "-bs_central_M0");
}

TEST_CASE("options of what a sphere displaces") {
  const auto fluid = [](std::vector<std::pair<const char*, const char*>> given) { return static_cast<DisplacedFluid>(accepted<TitledFluid>(given)); };
  REQUIRE_FALSE(fluid({}).active());
  REQUIRE_FALSE(fluid({{"-bs_added_mass", "0"}}).active());
  const DisplacedFluid both = fluid({{"-bs_buoyancy", nullptr}, {"-bs_added_mass", "0.5"}, {"-bs_fluid_density", "1000"}});
  REQUIRE((both.active() && both.buoyant && both.added == 0.5 && both.rho == 1000 && both.rho_given));
  REQUIRE(both.describe() == "spheres in a fluid of 1000 kg/m^3: buoyancy and added mass 0.5 rho V");
}

TEST_CASE("options of the drag laws") {
  REQUIRE(accepted<StokesDrag>({{"-bs_stokes_drag", "0.3"}}).D == 0.3);
  refused<StokesDrag>({{"-bs_stokes_drag", "-0.3"}}, "-bs_stokes_drag");
  REQUIRE(accepted<MassDrag>({{"-bs_viscosity", "0.01"}}).c == 0.01);
  refused<MassDrag>({{"-bs_viscosity", "-1"}}, "-bs_viscosity");

  const auto sphere = accepted<SphereDrag>({{"-bs_sphere_drag", nullptr},
                                            {"-bs_sphere_drag_rho", "0.9"},
                                            {"-bs_sphere_drag_mu", "1.693e-5"},
                                            {"-bs_fluid_velocity", "1,-2"},
                                            {"-bs_radius", "0.01"}});
  REQUIRE((sphere.active() && sphere.rho == 0.9 && sphere.mu == 1.693e-5 && sphere.radius == 0.01));
  REQUIRE((sphere.fluid[0] == 1 && sphere.fluid[1] == -2 && sphere.fluid[2] == 0));
  REQUIRE(sphere.describe().find("fluid at (1, -2) m/s") != std::string::npos);
  refused<SphereDrag>({{"-bs_sphere_drag", "1"}, {"-bs_sphere_drag_mu", "1"}}, "-bs_sphere_drag_rho");
  refused<SphereDrag>({{"-bs_sphere_drag", "1"}, {"-bs_sphere_drag_rho", "1"}}, "-bs_sphere_drag_mu");
  refused<SphereDrag>({{"-bs_sphere_drag_rho", "1"}}, "-bs_sphere_drag:");
  refused<SphereDrag>({{"-bs_sphere_drag", "1"}, {"-bs_sphere_drag_rho", "1"}, {"-bs_sphere_drag_mu", "0"}}, "_mu");
}

TEST_CASE("options of shape drag: every shape has its coefficient") {
  const std::pair<const char*, double> table[] = {{"none", 0},
                                                  {"sphere", 0.47},
                                                  {"half_sphere", 0.42},
                                                  {"cone", 0.50},
                                                  {"cube", 1.05},
                                                  {"angled_cube", 0.80},
                                                  {"long_cylinder", 0.82},
                                                  {"short_cylinder", 1.15},
                                                  {"streamlined_body", 0.04},
                                                  {"streamlined_half_body", 0.09}};
  for (const auto& [name, coefficient] : table) {
    const auto law = accepted<ShapeDrag>({{"-bs_shape_drag", name}, {"-bs_shape_drag_rho", "1.2"}, {"-bs_shape_drag_area", "0.5"}});
    REQUIRE(law.drag_coefficient == coefficient);
    REQUIRE(law.active() == (coefficient > 0));
    REQUIRE(law.describe().find(name) != std::string::npos);
  }
  const auto own = accepted<ShapeDrag>(
      {{"-bs_shape_drag_coefficient", "0.33"}, {"-bs_shape_drag_rho", "1.2"}, {"-bs_shape_drag_area", "0.5"}, {"-bs_fluid_velocity", "3"}});
  REQUIRE((own.active() && own.drag_coefficient == 0.33 && own.fluid[0] == 3));
  refused<ShapeDrag>({{"-bs_shape_drag", "brick"}}, "streamlined_half_body");
  refused<ShapeDrag>({{"-bs_shape_drag", "cube"}, {"-bs_shape_drag_rho", "1"}}, "-bs_shape_drag_area");
  refused<ShapeDrag>({{"-bs_shape_drag", "cube"}, {"-bs_shape_drag_area", "1"}}, "-bs_shape_drag_rho");
  refused<ShapeDrag>({{"-bs_shape_drag_area", "1"}}, "-bs_shape_drag ");
}

TEST_CASE("options of the laws of .xsp scenes") {
  const auto pull =
      accepted<XspAttraction>({{"-bs_xsp_attraction", "100"}, {"-bs_xsp_attraction_exponent", "2"}, {"-bs_xsp_attraction_center", "321,275"}});
  REQUIRE((pull.active() && pull.value == 100 && pull.exponent == 2 && pull.center[0] == 321 && pull.center[1] == 275));
  const auto walls = accepted<XspWalls>({{"-bs_xsp_walls", "5000"}, {"-bs_xsp_walls_exponent", "1"}, {"-bs_xsp_walls_sides", "1,0,0,1"}});
  REQUIRE((walls.active() && walls.value == 5000 && walls.exponent == 1 && walls.box[1] == 642 && walls.box[3] == 550));
  REQUIRE((walls.sides[0] && !walls.sides[1] && !walls.sides[2] && walls.sides[3]));
  REQUIRE(walls.describe().find("top bottom") != std::string::npos);
  REQUIRE_FALSE(accepted<XspWalls>({{"-bs_xsp_walls", "5000"}}).active());  // no wall is there
  REQUIRE(accepted<XspWalls>({{"-bs_xsp_walls_box", "-1,1,-2,2"}}).box[2] == -2);
  refused<XspWalls>({{"-bs_xsp_walls_box", "0,642"}}, "-bs_xsp_walls_box");
  refused<XspWalls>({{"-bs_xsp_walls_box", "1,0,0,1"}}, "-bs_xsp_walls_box");
  refused<XspWalls>({{"-bs_xsp_walls_sides", "1,1,1"}}, "-bs_xsp_walls_sides");
  refused<XspWalls>({{"-bs_xsp_walls_sides", "1,1,2,1"}}, "-bs_xsp_walls_sides");
  const auto whole = accepted<XspCenterOfMass>({{"-bs_xsp_center_of_mass", "10"}, {"-bs_xsp_center_of_mass_damping", "2"}});
  REQUIRE((whole.active() && whole.value == 10 && whole.damping == 2));
}

TEST_CASE("options of the motion of anchor points") {
  REQUIRE_FALSE(accepted<Motion>({}).active());
  const auto steady = accepted<Motion>({{"-bs_anchor_motion", "velocity"}, {"-bs_anchor_velocity", "1,-2"}});
  REQUIRE((steady.kind == Motion::Kind::velocity && steady.c[1] == -2));
  REQUIRE(steady.describe() == "anchor points move at (1, -2) m/s");
  const auto wave = accepted<Motion>(
      {{"-bs_anchor_motion", "sinusoid"}, {"-bs_anchor_amplitude", "0,0.5"}, {"-bs_anchor_frequency", "2"}, {"-bs_anchor_phase", "1.5"}});
  REQUIRE((wave.kind == Motion::Kind::sinusoid && wave.A[1] == 0.5 && wave.frequency == 2 && wave.phase == 1.5));
  REQUIRE(wave.describe().find("(0, 0.5) m at 2 Hz") != std::string::npos);
  const auto table = accepted<Motion>({{"-bs_anchor_motion", "table"}, {"-bs_anchor_table", "drive.csv"}});
  REQUIRE((table.kind == Motion::Kind::table && table.table_file == "drive.csv"));
  refused<Motion>({{"-bs_anchor_motion", "velocity"}}, "-bs_anchor_velocity");
  refused<Motion>({{"-bs_anchor_motion", "sinusoid"}, {"-bs_anchor_amplitude", "1"}}, "-bs_anchor_frequency");
  refused<Motion>({{"-bs_anchor_motion", "sinusoid"}, {"-bs_anchor_frequency", "1"}}, "-bs_anchor_amplitude");
  refused<Motion>({{"-bs_anchor_motion", "table"}}, "-bs_anchor_table");
  refused<Motion>({{"-bs_anchor_motion", "wobble"}}, "sinusoid");
  refused<Motion>({{"-bs_anchor_velocity", "1"}}, "-bs_anchor_motion velocity");
}
