#include "output/settings.hpp"

#include "base/options.hpp"

namespace bs {

PetscErrorCode read_output_settings(MPI_Comm comm, OutputSettings* settings) {
  TrajectoryOptions& file = settings->trajectory;
  std::int64_t pad = file.pad;
  int units = static_cast<int>(file.units);

  PetscFunctionBegin;
  PetscCall(read_section(comm, "Output options", [&](Section& section) {
    section.text("-bs_output", "trajectory to write, H5MD in HDF5 (suffix .h5md); none without", file.file);
    section.real("-bs_output_interval", "simulated time between frames; 0: every step [s]", settings->interval, Range::nonnegative);
    section.integer("-bs_output_pad",
                    "components written per particle, zeros appended (3: for readers that want x, y, z); 0: as many as "
                    "there are",
                    pad, Range::nonnegative);
    section.choice("-bs_output_units",
                   "unit attributes in the trajectory, the numbers stay as they are: none; SI (kg, m, s); real (u, Angstrom, fs), metal (u, "
                   "Angstrom, ps), nano (ag, nm, ns), whose lengths MDAnalysis knows",
                   {"none", "SI", "real", "metal", "nano"}, units);
    section.flag("-bs_output_xdmf",
                 "TRAJECTORY.xdmf beside the trajectory, by which ParaView opens it (not for one dimension without "
                 "-bs_output_pad)",
                 file.xdmf);
    section.flag("-bs_overwrite", "replace a trajectory, checkpoint or report that exists", file.overwrite);
    section.text("-bs_report", "closing report to write, JSON; none without", settings->report);
    section.real("-bs_progress_interval", "time between lines of progress; 0: every step; negative: quiet [s]", settings->progress_interval);
    if (pad > 1024) section.fail("option -bs_output_pad: " + std::to_string(pad) + " is too large: give 3");
  }));
  file.pad = static_cast<int>(pad);
  file.units = static_cast<OutputUnits>(units);
  PetscFunctionReturn(0);
}

}  // namespace bs
