#include "output/settings.hpp"

#include "base/options.hpp"

namespace bs {

PetscErrorCode read_output_settings(MPI_Comm comm, OutputSettings* settings) {
  TrajectoryOptions& file = settings->trajectory;
  std::int64_t pad = file.pad;
  int units = static_cast<int>(file.units);

  PetscFunctionBegin;
  PetscCall(read_section(comm, "Output options", [&](Section& section) {
    section.path("-bs_output", "trajectory file to write, in the H5MD format of HDF5 (suffix .h5md); default: none is written", file.file);
    section.real(
        "-bs_output_interval",
        "simulated time between frames; 0: a frame at every step; default: 0, and for linear systems of more than 2000 steps as many steps as "
        "give at most 2000 frames [s]",
        settings->interval, Range::nonnegative);
    section.real("-bs_output_flush",
                 "longest wall-clock time for which frames and the log of steps wait in memory before they are written and brought to disk, beside "
                 "the time of a step; 0: every frame at once [s]",
                 file.flush, Range::nonnegative);
    section.integer("-bs_output_pad",
                    "number of components written per particle, padded with zeros (3: for programs that expect x, y, z); 0: as many as the lattice "
                    "has dimensions",
                    pad, Range::nonnegative);
    section.choice("-bs_output_units",
                   "unit attributes of the trajectory; the numbers are not converted: none; SI (kg, m, s); real (u, Angstrom, fs), metal (u, "
                   "Angstrom, ps) and nano (ag, nm, ns), whose units of length MDAnalysis recognises",
                   {"none", "SI", "real", "metal", "nano"}, units);
    section.flag("-bs_output_xdmf",
                 "write TRAJECTORY.xdmf beside the trajectory, with which ParaView opens it (not written in one dimension without -bs_output_pad)",
                 file.xdmf);
    section.flag("-bs_overwrite", "replace an existing trajectory, checkpoint or report", file.overwrite);
    section.path("-bs_report", "file for the closing report, in JSON; default: none is written", settings->report);
    section.real("-bs_progress_interval", "wall-clock time between progress lines; 0: a line at every step; negative: no lines [s]",
                 settings->progress_interval);
    if (pad > 1024) section.fail("option -bs_output_pad: " + std::to_string(pad) + " is too large: give 3");
  }));
  file.pad = static_cast<int>(pad);
  file.units = static_cast<OutputUnits>(units);
  PetscFunctionReturn(0);
}

}  // namespace bs
