#include "base/rounding.hpp"
#include "base/text.hpp"

namespace bs {

std::string lost_in_rounding(double t, double h, double interval, double least) {
  if (h >= least && (interval <= 0 || interval >= least)) return {};
  const bool step = h < least;
  return format("%s %g s is lost in the rounding of t = %.10g s, beside which %g s is the least that counts: ",
                step ? "a step of" : "option -bs_output_interval:", step ? h : interval, t, least) +
         "let the time start at 0 (-ts_init_time), or give a larger one";
}

std::string endless(double steps) {
  constexpr double MOST = 2147483647;  // that a 32-bit count of steps holds
  if (!(steps > MOST)) return {};
  return format("the run would take %.3g steps, more than %.0f: give a larger -ts_dt, a smaller -ts_max_time, or -ts_max_steps", steps, MOST);
}

}  // namespace bs
