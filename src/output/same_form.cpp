// A trajectory that goes on keeps the form in which it was begun: what a run writes to every frame is compared with what the file has, before the
// first step. A dataset that does not grow with the others would break the promise that each has a row for every frame.
#include <algorithm>
#include <functional>
#include <numeric>
#include <set>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "output/frame_file.hpp"

namespace bs {

namespace {

PetscErrorCode extent_of(hid_t file, const std::string& path, std::vector<hsize_t>* extent) {
  hsize_t sizes[H5S_MAX_RANK] = {0};
  PetscFunctionBegin;
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose);
  BS_H5(space);
  const int axes = H5Sget_simple_extent_dims(space, sizes, nullptr);
  BS_H5(axes);
  extent->assign(sizes, sizes + axes);
  PetscFunctionReturn(0);
}

/// "a, b, c and 2 more"
std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t most = 3;
  std::string text;
  for (std::size_t k = 0; k < std::min(most, names.size()); ++k) text += (k > 0 ? ", " : "") + names[k];
  return names.size() > most ? text + " and " + std::to_string(names.size() - most) + " more" : text;
}

}  // namespace

/// Where what a run writes to GROUP/value has `numbers` in a frame, `columns` of each particle (0: it is not of particles): notes that the file has
/// nothing there, or why it does not fit.
PetscErrorCode Trajectory::Impl::compare_frames(const std::string& group, std::int64_t numbers, PetscInt components, FormDifferences* found) {
  std::vector<hsize_t> extent;
  PetscFunctionBegin;
  const std::string path = group + "/value";
  if (!h5_exists(file, path)) {
    found->missing.push_back(group);
    PetscFunctionReturn(0);
  }
  PetscCall(extent_of(file, path, &extent));
  if (extent.empty()) extent.push_back(0);
  const hsize_t there = std::accumulate(extent.begin() + 1, extent.end(), hsize_t{1}, std::multiplies<>());
  if (there == static_cast<hsize_t>(numbers) || !found->width.empty()) PetscFunctionReturn(0);
  if (components > 0 && extent.size() == 3)
    found->width = how_many(static_cast<std::int64_t>(extent[2]), "column") + " per particle, and this run writes " + std::to_string(components);
  else
    found->width = how_many(static_cast<std::int64_t>(there), "number") + " a frame in " + group + ", and this run writes " + std::to_string(numbers);
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::compare_form(FormDifferences* found) {
  std::set<std::string> own = {BOX_EDGES};  // of an open box it is written without an observable of the run
  std::string foreign;
  PetscFunctionBegin;
  for (const FieldColumn& field : fields) {
    const bool of_particles = field.group().rfind("/particles/trajectory/", 0) == 0;
    own.insert(field.group());
    PetscCall(compare_frames(field.group(), field.size() / 8, of_particles ? field.width() : 0, found));
  }
  for (const ObservableColumn& o : observables) {
    own.insert(o.group());
    PetscCall(compare_frames(o.group(), o.width, 0, found));
  }
  for (const Growing& set : growing_of(file, mark, &foreign)) {
    const std::string group = set.path.substr(0, set.path.rfind('/'));
    if (!set.log && !set.clock && own.count(group) == 0) found->surplus.push_back(group);
  }
  PetscFunctionReturn(0);
}

/// `changed`: the options by which it may have come about; empty: it is not known.
std::string FormDifferences::fault(const std::string& changed) const {
  const std::string remedy = changed.empty() ? ": continue with the options that it was begun with" : ": leave out " + changed;
  if (width.empty() && surplus.empty()) return {};
  return (width.empty() ? "has " + some_of(surplus) + " in every frame, and this run does not write it" : "has " + width) + remedy +
         ", or give another -bs_output";
}

std::string FormDifferences::warning(const std::string& changed) const {
  std::string text;
  if (!missing.empty()) text = "it has no " + some_of(missing) + ", which this run leaves out";
  if (!changed.empty()) text += std::string(text.empty() ? "" : "; ") + "it takes nothing of " + changed;
  return text.empty() ? text : "goes on in the form in which it was begun: " + text + ": give another -bs_output to have it";
}

PetscErrorCode Trajectory::require_form(const std::vector<Field>& given, const std::vector<Observable>& observables,
                                        const std::vector<std::string>& changed) {
  FormDifferences found;
  PetscErrorCode code = 0;
  PetscFunctionBegin;
  Impl& impl = *impl_;
  const std::string& file = impl.options.file;
  const IoWatch watch(impl.comm, "cannot read " + file, ": give another -bs_output, and the run goes on there");
  code = impl.describe(impl.written(given), observables);
  if (!code && impl.writer) code = impl.compare_form(&found);
  if (code) impl.usable = false;
  PetscCall(watch.report(impl.comm, code));
  const std::string options = some_of(changed);
  std::string fault = found.fault(options), warning = found.warning(options);
  PetscCall(share_text(impl.comm, &fault));
  PetscCall(share_text(impl.comm, &warning));
  if (!fault.empty()) {
    impl.usable = false;  // nothing of it is touched
    PetscCall(fail(impl.comm, Exit::input, "the trajectory " + file + " " + fault));
  }
  if (!warning.empty()) PetscCall(warn(impl.comm, "changed_columns", "the trajectory " + file + " " + warning));
  PetscFunctionReturn(0);
}

}  // namespace bs
