#include "output/xdmf.hpp"
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cstring>
#include <fstream>
#include "base/error.hpp"
#include "output/fresh_file.hpp"

namespace bs {

namespace {

constexpr std::int64_t every_frame = 50;
constexpr std::size_t most_modes = 100;  // in a sidecar, as in VTU files of postprocess/convert.py

/// What a DataItem says of a dataset.
struct Item {
  std::string path;  ///< FILE:/group/value, empty: not there
  std::vector<hsize_t> shape;
  std::size_t bytes = 8;  ///< of a number
  bool integer = false;
};

std::string joined(const std::vector<hsize_t>& numbers, std::size_t from = 0) {
  std::string out;
  for (std::size_t i = from; i < numbers.size(); ++i) out += (i > from ? " " : "") + std::to_string(numbers[i]);
  return out;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

PetscErrorCode describe(hid_t file, const std::string& name, const std::string& path, Item* item) {
  PetscFunctionBegin;
  *item = {};
  if (!h5_exists(file, path)) PetscFunctionReturn(0);
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose), type(H5Dget_type(set), H5Tclose);
  BS_H5(space);
  item->shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  BS_H5(H5Sget_simple_extent_dims(space, item->shape.data(), nullptr));
  item->bytes = H5Tget_size(type);
  item->integer = H5Tget_class(type) == H5T_INTEGER;
  item->path = name + ":" + path;
  PetscFunctionReturn(0);
}

/// Names of the datasets, not groups, in `group`: mass, id and fixed, then the others.
std::vector<std::string> constants(hid_t file, const std::string& group) {
  std::vector<std::string> names = {"mass", "id", "fixed"};
  const auto keep = [](hid_t at, const char* name, const H5L_info_t* link, void* data) -> herr_t {
    if (link->type != H5L_TYPE_HARD) return 0;
    auto& known = *static_cast<std::vector<std::string>*>(data);
    const H5 object(H5Oopen(at, name, H5P_DEFAULT), H5Oclose);
    if (H5Iget_type(object) == H5I_DATASET && std::find(known.begin(), known.end(), name) == known.end()) known.emplace_back(name);
    return 0;
  };
  (void)H5Literate_by_name(file, group.c_str(), H5_INDEX_NAME, H5_ITER_INC, nullptr, keep, &names, H5P_DEFAULT);
  return names;
}

PetscErrorCode read_times(hid_t file, std::vector<double>* times) {
  PetscFunctionBegin;
  times->clear();
  Item item;
  PetscCall(describe(file, "", "/particles/trajectory/position/time", &item));
  if (item.path.empty() || item.shape[0] == 0) PetscFunctionReturn(0);
  H5 set(H5Dopen2(file, "/particles/trajectory/position/time", H5P_DEFAULT), H5Dclose);
  times->resize(item.shape[0]);
  BS_H5(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, times->data()));
  PetscFunctionReturn(0);
}

std::string opening(const Item& item, const std::string& dimensions, const char* kind) {
  return format("<DataItem%s Dimensions=\"%s\" Format=\"HDF\" NumberType=\"%s\" Precision=\"%zu\">", kind, dimensions.c_str(),
                item.integer ? "Int" : "Float", item.bytes);
}

std::string whole(const Item& item) { return opening(item, joined(item.shape), "") + item.path + "</DataItem>"; }

/// Frame k of a dataset (T, ...). Readers of XDMF 2 take the hyperslab from the two items inside, those of XDMF 3 from
/// the words START:STRIDE:COUNT:SHAPE behind the path; each ignores what is the other's. "Type" is XDMF 2's old name of
/// "ItemType": under the new one readers of XDMF 3 would drop the words, too.
std::string slab(const Item& item, std::size_t k) {
  std::string start = std::to_string(k), ones = "1", count = "1 " + joined(item.shape, 1);
  for (std::size_t i = 1; i < item.shape.size(); ++i) start += " 0", ones += " 1";
  const std::string words = start + ":" + ones + ":" + count + ":" + joined(item.shape);
  return opening(item, joined(item.shape, 1), " Type=\"HyperSlab\"") + item.path + "|" + words +
         format("<DataItem Dimensions=\"3 %zu\" Format=\"XML\">%s %s %s</DataItem>", item.shape.size(), start.c_str(), ones.c_str(), count.c_str()) +
         whole(item) + "</DataItem>";
}

/// Column c of a dataset (T, N, columns) as N numbers.
std::string column_slab(const Item& item, std::size_t k, std::size_t c) {
  const std::string rows = std::to_string(item.shape[1]), start = std::to_string(k) + " 0 " + std::to_string(c), count = "1 " + rows + " 1";
  return opening(item, rows, " Type=\"HyperSlab\"") + item.path + "|" + start + ":1 1 1:" + count + ":" + joined(item.shape) +
         format("<DataItem Dimensions=\"3 3\" Format=\"XML\">%s 1 1 1 %s</DataItem>", start.c_str(), count.c_str()) + whole(item) + "</DataItem>";
}

/// Frame k less the first one, which the reader computes; those of XDMF 3 leave it out.
std::string since_first(const Item& item, std::size_t k) {
  return opening(item, joined(item.shape, 1), " ItemType=\"Function\" Function=\"$0 - $1\"") + slab(item, k) + slab(item, 0) + "</DataItem>";
}

/// Component names of a symmetric tensor kept as `columns` numbers; a one-dimensional one may have zeros appended.
std::vector<std::string> tensor_names(std::size_t columns) {
  if (columns > 3) return {"xx", "yy", "zz", "yz", "xz", "xy"};
  std::vector<std::string> names = {"xx", "yy", "xy"};
  names.resize(columns);
  return names;
}

/// By the numbers of a row: readers take two or three for a vector.
const char* type_of(const Item& item) {
  const hsize_t columns = item.shape.size() < 2 ? 1 : item.shape.back();
  return columns == 1 ? "Scalar" : columns <= 3 ? "Vector" : "Matrix";
}

std::string attribute(const std::string& name, const char* type, const char* center, const std::string& data) {
  return format("<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">", name.c_str(), type, center) + data + "</Attribute>\n";
}

/// The datasets of a trajectory that a viewer can show.
struct Contents {
  Item position, velocity, bonds, drawn, stress, modes;
  std::vector<std::pair<std::string, Item>> of_particles, of_springs, in_frames;  ///< in_frames: of springs, frame by frame

  PetscErrorCode find(hid_t file, const std::string& name) {
    const std::string particles = "/particles/trajectory/", bonds_path = "/connectivity/bonds";
    Item item;
    PetscFunctionBegin;
    PetscCall(describe(file, name, particles + "position/value", &position));
    PetscCall(describe(file, name, particles + "velocity/value", &velocity));
    PetscCall(describe(file, name, bonds_path + "_drawn", &bonds));  // of a periodic box: without lines across it
    if (bonds.path.empty()) PetscCall(describe(file, name, bonds_path, &bonds));
    PetscCall(describe(file, name, "/backspring/drawn/value", &drawn));  // where springs break: those that are whole at each frame
    for (const char* path :
         {"/backspring/strain", "/observables/springs/strain", "/observables/springs/tension", "/observables/springs/stress", "/backspring/broken"}) {
      PetscCall(describe(file, name, std::string(path) + "/value", &item));
      if (!item.path.empty()) in_frames.emplace_back(std::strrchr(path, '/') + 1, item);
    }
    PetscCall(describe(file, name, particles + "stress_volume/value", &stress));
    PetscCall(describe(file, name, "/modes/shape", &modes));
    for (const std::string& constant : constants(file, particles.substr(0, particles.size() - 1))) {
      PetscCall(describe(file, name, particles + constant, &item));
      if (!item.path.empty()) of_particles.emplace_back(constant, item);
    }
    for (const char* constant : {"stiffness", "rest_length", "area"}) {
      PetscCall(describe(file, name, bonds_path + "_" + constant, &item));
      if (!item.path.empty()) of_springs.emplace_back(constant, item);
    }
    PetscFunctionReturn(0);
  }

  std::string frame(std::size_t k, double time) const {
    std::string out = format("<Grid Name=\"frame_%zu\" GridType=\"Uniform\"><Time Value=\"%.17g\"/>\n", k, time);
    if (bonds.path.empty())
      out += format("<Topology TopologyType=\"Polyvertex\" NodesPerElement=\"1\" NumberOfElements=\"%llu\"/>\n",
                    static_cast<unsigned long long>(position.shape[1]));
    else
      out += format("<Topology TopologyType=\"Polyline\" NodesPerElement=\"2\" NumberOfElements=\"%llu\">",
                    static_cast<unsigned long long>(bonds.shape[0])) +
             (drawn.path.empty() ? whole(bonds) : slab(drawn, k)) + "</Topology>\n";
    out += format("<Geometry GeometryType=\"%s\">", position.shape[2] == 2 ? "XY" : "XYZ") + slab(position, k) + "</Geometry>\n";
    if (!velocity.path.empty()) out += attribute("velocity", "Vector", "Node", slab(velocity, k));
    out += attribute("displacement", "Vector", "Node", since_first(position, k));
    for (std::size_t j = 0; !modes.path.empty() && j < std::min<std::size_t>(modes.shape[0], most_modes); ++j)
      out += attribute(format("mode_%03zu", j), "Vector", "Node", slab(modes, j));
    const std::vector<std::string> parts = stress.path.empty() ? std::vector<std::string>{} : tensor_names(stress.shape[2]);
    for (std::size_t c = 0; c < parts.size(); ++c) out += attribute("stress_volume_" + parts[c], "Scalar", "Node", column_slab(stress, k, c));
    for (const auto& [name, item] : of_particles) out += attribute(name, type_of(item), "Node", whole(item));
    for (const auto& [name, item] : in_frames) out += attribute(name, "Scalar", "Cell", slab(item, k));
    for (const auto& [name, item] : of_springs) out += attribute(name, type_of(item), "Cell", whole(item));
    return out + "</Grid>\n";
  }
};

const char* const head =
    "<?xml version=\"1.0\"?>\n<Xdmf Version=\"2.0\"><Domain>\n"
    "<Grid Name=\"trajectory\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";

std::string name_in_text(const std::string& trajectory) { return escaped(trajectory.substr(trajectory.rfind('/') + 1)); }

}  // namespace

/// Whether `file` is a sidecar, of a trajectory whose name ends in `trajectory` as XML has it.
static bool describes(const std::string& file, const std::string& trajectory) {
  std::string text(8192, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text.rfind(head, 0) == 0 && text.find(trajectory + ":/particles/trajectory/position/value") != std::string::npos;
}

bool is_sidecar(const std::string& file) { return describes(file, ""); }

void remove_sidecar(const std::string& trajectory) {
  const std::string name = trajectory + ".xdmf";
  struct stat status;
  if (lstat(name.c_str(), &status) == 0 && S_ISREG(status.st_mode) && describes(name, ">" + name_in_text(trajectory))) (void)unlink(name.c_str());
}

bool fits_xml(const std::string& name) {
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t length = utf8_length(name, at);
    const auto lead = static_cast<unsigned char>(name[at]);
    if (length == 0 || lead < ' ' || lead == 0x7f) return false;
    at += length;
  }
  return true;
}

/// The text of the sidecar; empty for a file without particles in two or three columns.
static PetscErrorCode xdmf_text(hid_t file, const std::string& trajectory, std::string* text) {
  std::vector<double> times;
  Contents contents;
  PetscFunctionBegin;
  text->clear();
  // beside the trajectory: found wherever both are moved
  PetscCall(contents.find(file, name_in_text(trajectory)));
  const Item& position = contents.position;
  if (position.path.empty() || position.shape[2] < 2 || position.shape[2] > 3) PetscFunctionReturn(0);
  PetscCall(read_times(file, &times));
  if (times.empty()) PetscFunctionReturn(0);
  *text = head;
  for (std::size_t k = 0; k < times.size(); ++k) *text += contents.frame(k, times[k]);
  *text += "</Grid>\n</Domain></Xdmf>\n";
  PetscFunctionReturn(0);
}

PetscErrorCode Xdmf::update(hid_t file, bool last, std::string* reason) {
  std::string text;
  Item time;
  PetscFunctionBegin;
  reason->clear();
  PetscCall(describe(file, "", "/particles/trajectory/position/time", &time));
  const std::int64_t frames = time.path.empty() ? 0 : static_cast<std::int64_t>(time.shape[0]);
  const std::int64_t due = described_ + (described_ > every_frame ? described_ / every_frame : 1);
  if (frames == described_ || (!last && frames < due)) PetscFunctionReturn(0);
  PetscCall(xdmf_text(file, trajectory_, &text));
  if (text.empty()) remove_sidecar(trajectory_);
  else if (const int why = write_whole(name(), text, true)) *reason = std::strerror(why);
  described_ = frames;
  PetscFunctionReturn(0);
}

}  // namespace bs
