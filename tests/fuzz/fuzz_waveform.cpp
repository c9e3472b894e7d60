// Waveforms, read and evaluated.
#include "common.hpp"
#include "systems/linear/waveform.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<bs::Waveform> waves;
  const std::string error = bs::read_waveforms(text_of(data, size), &waves);
  if (!error.empty()) {
    require_message(error, "source ");
    return 0;
  }
  require(!waves.empty(), "at least one waveform");
  for (const bs::Waveform& wave : waves) {
    for (const double t : {-1.0, 0.0, 1e-300, 1e-6, 0.5, 1.0, 1.0 + 1e-13, 7.5, 1e9}) require(std::isfinite(wave.at(t)), "values are finite");
    if (wave.constant()) require(wave.at(0) == wave.at(3) && wave.at(3) == wave.at(1e9), "constant");
  }
  return 0;
}
