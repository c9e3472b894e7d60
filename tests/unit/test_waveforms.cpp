// Waveforms against their closed forms, at their knots and beside them; faults; noise without a crash.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include "model/linear/waveform.hpp"

namespace {

bs::Waveform wave(const std::string& text) {
  bs::Waveform w;
  REQUIRE(bs::read_waveform(text, &w) == "");
  return w;
}

std::string fault(const std::string& text) {
  bs::Waveform w;
  return bs::read_waveform(text, &w);
}

}  // namespace

TEST_CASE("Constant and step") {
  CHECK(wave("2.5").at(7) == 2.5);
  CHECK(wave(" constant( value = -1 ) ").at(0) == -1);
  CHECK(wave("step(3)").at(0) == 3);  // on at t0
  CHECK(wave("step(3)").at(-1e-12) == 0);
  CHECK(wave("step(amp=3,t0=2,offset=1)").at(2) == 4);
  CHECK(wave("step(3,2,1)").at(1.999) == 1);
  CHECK(wave("step(3)").constant());
  CHECK_FALSE(wave("step(3,1)").constant());
}

TEST_CASE("Pulse: every piece, its knots, and its period") {
  const bs::Waveform w = wave("pulse(amp=4,t0=1,rise=0.5,width=2,fall=1,offset=-1)");
  const double times[] = {0, 1, 1.25, 1.5, 3, 3.5, 4, 4.5, 9}, values[] = {0, 0, 2, 4, 4, 4, 2, 0, 0};
  for (int k = 0; k < 9; ++k) CHECK(w.at(times[k]) == Approx(values[k] - 1).margin(1e-15));
  const bs::Waveform square = wave("pulse(amp=1,t0=1,width=2)");
  CHECK(square.at(1) == 1);
  CHECK(square.at(3) == 0);
  const bs::Waveform train = wave("pulse(amp=1,rise=0,width=1,period=3)");
  for (int k = 0; k < 50; ++k) {
    CHECK(train.at(3.0 * k) == 1);
    CHECK(train.at(3.0 * k + 1) == 0);
    CHECK(train.at(3.0 * k + 2.9) == 0);
  }
}

TEST_CASE("A knot met up to rounding is met") {
  // 0.1 ten times over is not 1
  double t = 0;
  for (int k = 0; k < 10; ++k) t += 0.1;
  REQUIRE(t < 1);
  CHECK(wave("step(1,1)").at(t) == 1);
  CHECK(wave("pulse(amp=1,t0=1,width=1)").at(t) == 1);
  CHECK(wave("pwl(0,0,1,5,2,0)").at(t) == 5);
  CHECK(wave("step(1,1)").at(1 - 1e-6) == 0);
}

TEST_CASE("Sine, exponential, piecewise linear") {
  const double pi = std::acos(-1.0);
  const bs::Waveform s = wave("sine(amp=2,freq=50,phase=0.3,offset=1,delay=0.01)");
  CHECK(s.at(0.013) == Approx(1 + 2 * std::sin(2 * pi * 50 * 0.003 + 0.3)).epsilon(1e-14));
  CHECK(s.at(0.002) == Approx(1 + 2 * std::sin(0.3)).epsilon(1e-15));
  const bs::Waveform e = wave("exp(1,3,1,0.5,4,2)");
  CHECK(e.at(0.5) == 1);
  CHECK(e.at(2) == Approx(1 + 2 * (1 - std::exp(-2.0))).epsilon(1e-15));
  CHECK(e.at(6) == Approx(1 + 2 * (1 - std::exp(-10.0)) - 2 * (1 - std::exp(-1.0))).epsilon(1e-14));
  CHECK(wave("exp(v1=0,v2=1,tau1=2)").at(2) == Approx(1 - std::exp(-1.0)).epsilon(1e-15));
  const bs::Waveform p = wave("pwl(1,2,3,-2,4,0)");
  CHECK(p.at(0) == 2);
  CHECK(p.at(2) == 0);
  CHECK(p.at(3) == -2);
  CHECK(p.at(3.5) == -1);
  CHECK(p.at(10) == 0);
}

TEST_CASE("Several waveforms, and faults that say what to write") {
  std::vector<bs::Waveform> list;
  CHECK(bs::read_waveforms("step(1); sine(1,2) ;3", &list) == "");
  CHECK(list.size() == 3);
  CHECK_THAT(fault("stp(1)"), Catch::Contains("did you mean step?"));
  CHECK_THAT(fault("pulse(1)"), Catch::Contains("width is missing: write pulse(amp=..,t0=..,rise=..,width=.."));
  CHECK_THAT(fault("sine(1,-2)"), Catch::Contains("freq = -2"));
  CHECK_THAT(fault("step(nan)"), Catch::Contains("is not a number"));
  for (const char* text : {"sine(1,01e308,1)", "1e308", "1e999", "step(1e-300)", "pwl(0,1,1e200,1)"})
    CHECK_THAT(fault(text), Catch::Contains("is out of range: write 0, or a number of 1e-100 to 1e100"));
  CHECK_THAT(fault("exp(0,1,2,1,1,1)"), Catch::Contains("t2 lies before t1"));
  CHECK_THAT(fault("pwl()"), Catch::Contains("no pairs"));
  CHECK_THAT(fault(""), Catch::Contains("write a number"));
  CHECK_THAT(fault("("), Catch::Contains("write a number"));
}

TEST_CASE("Any text is read or refused, and what is read is finite") {
  std::mt19937 random(5);
  const std::string letters = "stepulinxcoa()=,;.-+0123456789e ";
  const char* const seeds[] = {"pulse(amp=5,t0=1,rise=1,width=2,fall=1,period=9)", "exp(0,1,0,1)", "pwl(0,0,1,1)", "sine(1,2)", "step(1)"};
  int read = 0;
  for (int k = 0; k < 20000; ++k) {
    std::string text = seeds[random() % 5];
    for (unsigned edits = 1 + static_cast<unsigned>(random() % 3); edits > 0; --edits) {
      const std::size_t at = random() % text.size();
      if (random() % 2) text[at] = letters[random() % letters.size()];
      else text.insert(at, 1, letters[random() % letters.size()]);
    }
    bs::Waveform w;
    if (!bs::read_waveform(text, &w).empty()) continue;
    ++read;
    for (const double t : {0.0, 0.3, 1.0, 2.0, 1e3}) {
      INFO(text);
      CHECK(std::isfinite(w.at(t)));
    }
  }
  CHECK(read > 1000);
}
