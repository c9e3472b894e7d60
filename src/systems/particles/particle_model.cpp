#include "systems/particles/particle_model.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "base/memory.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "physics/pair/springs/registry.hpp"
#include "systems/client.hpp"
#include "systems/model.hpp"

namespace bs {

namespace {

/// A trajectory that is read back as a lattice must know its laws: what the input said is put among the options.
PetscErrorCode record_option(const char* name, const char* value) {
  PetscFunctionBegin;
  PetscCall(set_unless_given(name, value));
  (void)is_given(name);  // asked for: not an unused option
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode ParticleModel::create(MPI_Comm comm, Lattice&& lattice, std::unique_ptr<Mechanics>* out) {
  PetscFunctionBegin;
  auto model = std::make_unique<ParticleModel>();
  NetworkOptions options;
  PetscCall(read_network_options(comm, &options));
  model->net_.comm = comm;
  model->net_.room = held_by<Client>(comm).changes_numbers;
  // springs with a law each have it in the trajectory
  if (!lattice.law_by_row) PetscCall(record_option("-bs_spring_law", spring_laws()[static_cast<std::size_t>(lattice.spring_law)].name));
  PetscCall(record_option("-bs_damping_law", damper_laws()[static_cast<std::size_t>(lattice.damping_law)].first.c_str()));
  PetscCall(model->read_laws(lattice));
  PetscCall(model->coupling_.read_options(comm, lattice, &options));
  options.couples = couples_of(held_by<ForceCallback>(comm));
  if (!options.couples.empty() && lattice.box.active())
    PetscCall(fail(comm, Exit::input,
                   "forces of your own between particles know no images of them and give no stress: in a periodic box they are springs"));
  if (model->coupling_.has_center_particle()) std::get<XspAttraction>(model->laws_).value = 0;
  std::vector<std::uint8_t> fixed = lattice.fixed;
  PetscCall(model->constraints_.read(comm, &lattice));
  PetscCall(model->forces_.read(comm, lattice));
  BreakRules rules;
  PetscCall(rules.read(comm, lattice));
  PetscCall(model->take_fingerprint(lattice, fixed));
  PetscCall(build_network(comm, lattice, options, &model->net_));
  lattice.fixed = std::move(fixed);
  PetscCall(model->constraints_.create(&model->net_));
  PetscCall(model->check_laws());
  model->add_mass();
  model->lattice_ = std::move(lattice);
  PetscCall(model->create_state());
  PetscCall(model->springs_.create(model->net_, model->lattice_));
  PetscCall(model->stress_.create(model->net_));
  PetscCall(model->coupling_.create(model->net_, model->pattern_));
  model->terms_ = std::make_unique<Terms>(model->net_, model->laws_, model->constraints_.anchors(), model->pattern_,
                                          model->coupling_.active() ? &model->coupling_ : nullptr);
  PetscCall(model->terms_->remember(model->net_, model->lattice_, rules));
  PetscCall(model->keep_drawn());
  PetscCall(model->forces_.create(model->net_));
  if (model->forces_.active()) model->terms_->add(model->forces_);
  model->callback_.create(model->net_, model->pattern_);
  if (model->callback_.active()) model->terms_->add(model->callback_);
  model->find_roomless();
  PetscCall(model->commit_start());
  PetscCall(model->linearised_.create(model->net_, *model->terms_, model->pattern_, model->y0_, model->coupling_.active()));
  PetscCall(model->potential_.create(model->net_, *model->terms_, model->y0_, model->coupling_.active()));
  PetscCall(model->reactions_.create(model->net_, *model->terms_, model->forces_));
  model->force_.resize(static_cast<std::size_t>(model->net_.n * model->net_.dim));
  model->rates_ = model->terms_->rates();
  *out = std::move(model);
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::read_laws(const Lattice& lattice) {
  PetscFunctionBegin;
  DisplacedFluid& fluid = std::get<UniformGravity>(laws_).fluid;
  PetscCall(read_section(net_.comm, "Forces on particles", [&](Section& o) {
    read_options(laws_, o);
    fluid.options(o);
  }));
  PetscCall(find_fluid(&fluid));
  for_each_law(laws_, [&](auto& law) {
    using Law = std::decay_t<decltype(law)>;
    if constexpr (acts_by_column<Law>::value) law.given = find_column(lattice.particle_columns, particle_parameters[Law::column].name) != nullptr;
  });
  for_each_law(laws_, [&](const auto& law) {
    if (is_drag<std::decay_t<decltype(law)>> && law.active()) constraints_.box().set_drag(law.title);
  });
  PetscCall(constraints_.read_anchors(net_.comm, lattice.dim));
  PetscFunctionReturn(0);
}

/// Its density and the radius of particles that have none of their own, which drag may have said.
PetscErrorCode ParticleModel::find_fluid(DisplacedFluid* fluid) const {
  const SphereDrag& sphere = std::get<SphereDrag>(laws_);
  const ShapeDrag& shape = std::get<ShapeDrag>(laws_);
  const std::pair<const char*, double> said[] = {{"-bs_sphere_drag_rho", sphere.active() ? sphere.rho : 0},
                                                 {"-bs_shape_drag_rho", shape.active() ? shape.rho : 0}};
  PetscFunctionBegin;
  fluid->radius = sphere.radius;
  if (!fluid->active() && fluid->rho_given)
    PetscCall(fail(net_.comm, Exit::input, "option -bs_fluid_density is for -bs_buoyancy and -bs_added_mass: give one of them, or leave it out"));
  if (!fluid->active()) PetscFunctionReturn(0);
  for (const auto& [option, rho] : said) {
    if (rho > 0 && fluid->rho > 0 && rho != fluid->rho)
      PetscCall(fail(net_.comm, Exit::input,
                     format("option %s: the fluid has a density of %g kg/m^3 here and of %g kg/m^3 in another option: give one density", option, rho,
                            fluid->rho)));
    if (rho > 0) fluid->rho = rho;
  }
  if (!(fluid->rho > 0))
    PetscCall(fail(net_.comm, Exit::input, "options -bs_buoyancy and -bs_added_mass need the density of the fluid: give -bs_fluid_density [kg/m^3]"));
  if (fluid->buoyant && !std::get<UniformGravity>(laws_).active())
    PetscCall(fail(net_.comm, Exit::input, "option -bs_buoyancy needs -bs_gravity, which presses the fluid up: give it too"));
  PetscFunctionReturn(0);
}

/// M = m + C rho V
void ParticleModel::add_mass() {
  const DisplacedFluid& fluid = std::get<UniformGravity>(laws_).fluid;
  if (fluid.added == 0) return;
  for (PetscInt i = 0; i < net_.n; ++i) net_.inertia[static_cast<std::size_t>(i)] += fluid.added * fluid.mass(net_.columns(i));
}

/// What single options cannot know: the dimension and the particles.
PetscErrorCode ParticleModel::check_laws() const {
  Error fault;
  PetscFunctionBegin;
  const UniformGravity& gravity = std::get<UniformGravity>(laws_);
  const SphereDrag& sphere = std::get<SphereDrag>(laws_);
  const XspAttraction& attraction = std::get<XspAttraction>(laws_);
  const Motion& anchors = constraints_.anchors();
  std::vector<std::tuple<std::string, const double*, int>> vectors = {{"-bs_gravity", gravity.g, gravity.components},
                                                                      {"-bs_fluid_velocity", sphere.fluid, sphere.components},
                                                                      {"-bs_xsp_attraction_center", attraction.center, attraction.components},
                                                                      {"-bs_anchor_velocity", anchors.c, anchors.components},
                                                                      {"-bs_anchor_amplitude", anchors.A, anchors.components}};
  for (const CentralGravity& mass : std::get<Several<CentralGravity>>(laws_).all) vectors.emplace_back(mass.place, mass.x0, mass.components);
  for (const auto& [name, value, given] : vectors) {
    if (std::any_of(value + net_.dim, value + 3, [](double one) { return one != 0; }))
      fault.note(-1, format("option %s has a component beyond the lattice's dimension %d: give %s", name.c_str(), net_.dim,
                            how_many(net_.dim, "number").c_str()));
    else if (given < net_.dim && std::any_of(value, value + given, [](double one) { return one != 0; }))
      PetscCall(warn(net_.comm, "few_components",
                     format("option %s has %s in %d dimensions: the others are 0, as in %s", name.c_str(), how_many(given, "number").c_str(),
                            net_.dim, vector_text(value, net_.dim).c_str())));
  }
  if (is_given("-bs_fluid_velocity") && !std::get<SphereDrag>(laws_).active() && !std::get<ShapeDrag>(laws_).active())
    fault.note(-1,
               "option -bs_fluid_velocity applies to sphere and shape drag; -bs_stokes_drag and -bs_viscosity assume a fluid at rest: "
               "leave it out, or give -bs_sphere_drag or -bs_shape_drag");
  const DisplacedFluid& fluid = std::get<UniformGravity>(laws_).fluid;
  const bool drag = std::get<SphereDrag>(laws_).active();
  if (drag || fluid.active())
    for (PetscInt i = 0; i < net_.n; ++i)
      if (!(fluid.radius_of(net_.columns(i)) > 0))
        fault.note(net_.row[i],
                   format("particle %lld has no radius, which %s needs: give -bs_radius or the lattice's radii", static_cast<long long>(net_.row[i]),
                          drag            ? "sphere drag"
                          : fluid.buoyant ? "buoyancy"
                                          : "added mass"));
  PetscCall(fail_if_any(net_.comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::create_state() {
  const PetscInt d = net_.dim;
  PetscFunctionBegin;
  layout_ = {d, net_.n};
  PetscCall(create_vec(net_.comm, net_.n, layout_.block(), y0_.out()));
  {
    const WriteArray ay(y0_);  // given back before others write
    for (PetscInt i = 0; i < net_.n; ++i) {
      std::copy_n(&net_.held[i * d], d, &ay[layout_.x(i)]);
      std::copy_n(&net_.velocity[i * d], d, &ay[layout_.v(i)]);
    }
  }
  PetscReal start;
  PetscCall(read_start_time(&start));
  PetscCall(follow_box(start, y0_));
  PetscCall(constraints_.stop(y0_));
  PetscCall(state_.create(net_, y0_));
  PetscFunctionReturn(0);
}

/// A spring that starts beyond its yield force has yielded. A continued run goes on from other histories than these.
PetscErrorCode ParticleModel::commit_start() {
  double before = 0, after = 0;
  PetscReal start;
  PetscFunctionBegin;
  if (!terms_->remembers()) PetscFunctionReturn(0);
  const bool continued = is_given("-bs_restart") || held_by<Client>(net_.comm).gives_histories;
  PetscCall(terms_->dissipated(&before));
  PetscCall(read_start_time(&start));
  PetscCall(gather(start, y0_));
  PetscCall(commit({start, 0}));
  PetscCall(terms_->dissipated(&after));
  if (after > before && !continued)
    PetscCall(warn(net_.comm, "yielded_at_start",
                   format("%s: springs are given beyond their yield force: they have yielded in the first frame, which dissipated %.6g J",
                          net_.source.c_str(), after - before)));
  PetscFunctionReturn(0);
}

std::vector<Drive*> ParticleModel::drives() {
  std::vector<Drive*> all;
  forces_.list_drives(&all);
  constraints_.list_drives(&all);
  return all;
}

Knot ParticleModel::next_knot(double from, double to) {
  Knot next;
  for (const Drive* drive : drives()) next.take(drive->next_knot(from, to));
  return next;
}

void ParticleModel::set_sides(const Sides& sides) {
  for (Drive* drive : drives()) drive->set_sides(sides);
  terms_->renew();
}

PetscErrorCode ParticleModel::create_first_order(Mat* J) {
  PetscFunctionBegin;
  if (!pattern_.created()) pattern_.create(net_);
  PetscCall(reserve_memory(net_.comm, {"the assembled Jacobian of " + net_.source, pattern_.jacobian_bytes(net_.dim),
                                       "give -bs_operator shell or -snes_mf, which do not need it"}));
  PetscCall(pattern_.create_matrix(net_, J));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::assemble_first_order(double sigma, bool momentum, Mat J) {
  const LocalState& state = linearised_.state();
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::jacobian, J);
  PetscCall(terms_->gather(state));
  RowWriter writer(net_, pattern_);
  PetscCall(writer.begin(J));
  PetscCall(terms_->jacobian(linearised_.time(), state, sigma, momentum, &writer));
  PetscCall(writer.end());
  // of a spring at one end: distance and length 3d, rates 10, t I + w w^T and its place in two blocks 4d^2
  PetscCall(PetscLogFlops((4.0 * net_.dim * net_.dim + 3.0 * net_.dim + 10) * static_cast<double>(net_.links.other.size())));
  PetscFunctionReturn(0);
}

std::vector<Tally> ParticleModel::tallies() const {
  std::vector<Tally> all = terms_->breaking().tallies();
  all.push_back({"springs", "", net_.springs_total});
  if (lattice_.springs_generated == 0) return all;
  all.push_back({"springs_generated", "", lattice_.springs_generated});
  all.push_back({"springs_removed", "", lattice_.springs_removed});
  return all;
}

}  // namespace bs
