#include <map>
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/version.hpp"
#include "output/frame_file.hpp"

namespace bs {

PetscErrorCode write_h5md(hid_t file, MPI_Comm comm, bool units) {
  char user[256] = "";
  H5 root, author, creator, module;
  PetscFunctionBegin;
  PetscCall(open_group(file, "/h5md", &root));
  PetscCall(put_attribute(root, "version", std::vector<std::int32_t>{1, 1}));
  PetscCall(PetscGetUserName(user, sizeof user));
  // Attributes must be the same on every rank, whatever the machines call the user.
  PetscCallMPI(MPI_Bcast(user, static_cast<PetscMPIInt>(sizeof user), MPI_CHAR, 0, comm));
  PetscCall(open_group(file, "/h5md/author", &author));
  PetscCall(put_attribute(author, "name", std::string(*user ? user : "unknown")));
  PetscCall(open_group(file, "/h5md/creator", &creator));
  PetscCall(put_attribute(creator, "name", std::string("backspring")));
  PetscCall(put_attribute(creator, "version", std::string(version())));
  if (units) {
    PetscCall(open_group(file, "/h5md/modules/units", &module));
    PetscCall(put_attribute(module, "version", std::vector<std::int32_t>{1, 0}));
    PetscCall(put_attribute(module, "system", std::string("SI")));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode write_box(hid_t file, int dim, std::vector<std::string> boundary) {
  H5 box;
  PetscFunctionBegin;
  PetscCall(open_group(file, "/particles/trajectory/box", &box));
  PetscCall(put_attribute(box, "dimension", static_cast<std::int64_t>(dim)));
  boundary.resize(static_cast<std::size_t>(dim), "none");
  PetscCall(put_words(box, "boundary", boundary));
  PetscFunctionReturn(0);
}

PetscErrorCode write_parameters(hid_t file, PetscMPIInt ranks) {
  std::vector<std::pair<std::string, std::string>> options;
  std::map<std::string, std::string> table;
  PetscInt major, minor, subminor;
  H5 group, given;
  PetscFunctionBegin;
  PetscCall(PetscGetVersionNumber(&major, &minor, &subminor, nullptr));
  PetscCall(open_group(file, "/parameters", &group));
  PetscCall(put_attribute(group, "program", std::string("backspring")));
  PetscCall(put_attribute(group, "version", std::string(version())));
  PetscCall(put_attribute(group, "petsc_version", format("%d.%d.%d", (int)major, (int)minor, (int)subminor)));
  PetscCall(put_attribute(group, "ranks", static_cast<std::int64_t>(ranks)));
  PetscCall(options_in_force(&options));
  for (const auto& option : options) table[option.first] = option.second;  // of variable length: no limit
  PetscCall(open_group(file, "/parameters/options", &given));
  for (const auto& option : table) PetscCall(put_attribute(given, option.first.c_str(), option.second));
  PetscFunctionReturn(0);
}

std::string unit_of(const Powers& powers, OutputUnits units) {
  struct Base {
    const char *mass, *length, *time;
  };
  static const Base bases[] = {{"", "", ""}, {"kg", "m", "s"}, {"u", "Angstrom", "fs"}, {"u", "Angstrom", "ps"}, {"ag", "nm", "ns"}};
  if (units == OutputUnits::none) return {};
  const Base& base = bases[static_cast<int>(units)];
  std::string text;
  const auto add = [&text](const char* unit, int power) {
    if (power) text += (text.empty() ? "" : " ") + std::string(unit) + (power == 1 ? "" : format("%+d", power));
  };
  add(base.mass, powers.mass);
  add(base.length, powers.length);
  add(base.time, powers.time);
  return text;
}

std::string unit_of_quantity(const std::string& name, OutputUnits units) {
  static const std::map<std::string, Powers> powers = {
      {"position", {0, 1, 0}},
      {"velocity", {0, 1, -1}},
      {"force", {1, 1, -2}},
      {"time", {0, 0, 1}},
      {"mass", {1, 0, 0}},
      {"kinetic_energy", {1, 2, -2}},
      {"elastic_energy", {1, 2, -2}},
      {"potential_energy", {1, 2, -2}},
      {"total_energy", {1, 2, -2}},
      {"momentum", {1, 1, -1}},
      {"angular_momentum", {1, 2, -1}},
      {"bonds_rest_length", {0, 1, 0}},
      {"bonds_damping", {1, 0, -1}},
      {"dissipated_energy", {1, 2, -2}},
      {"broken_energy", {1, 2, -2}},
      {"released_energy", {1, 2, -2}},
      {"unbalanced_force", {1, 1, -2}},
      {"stress_volume", {1, 2, -2}},
      {BOX_EDGES, {0, 1, 0}},
  };
  const std::string first = name.substr(0, name.find('/'));
  const std::string kind = first == "reaction" || first == "force"                            ? "force"
                           : first == "work" || first == "stress_volume" || first == "moment" ? "total_energy"
                                                                                              : name;
  const auto at = powers.find(kind);
  return at == powers.end() ? std::string() : unit_of(at->second, units);
}

}  // namespace bs
