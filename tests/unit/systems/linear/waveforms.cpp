// Waveforms against their closed forms, at their knots and beside them; faults; noise without a crash.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include "systems/linear/waveform.hpp"

namespace {

bs::Waveform wave(const std::string& text) {
  bs::Waveform w;
  REQUIRE(bs::read_waveform(text, &w).empty());
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

TEST_CASE("Before a jump a waveform has its limit from the left, elsewhere what it is") {
  CHECK(wave("step(3,2,1)").before(2) == 1);
  CHECK(wave("step(3,2,1)").before(2.5) == 4);
  const bs::Waveform square = wave("pulse(amp=1,t0=1,width=2,period=4,offset=5)"), slope = wave("pulse(amp=4,t0=1,rise=0.5,width=2,fall=1)");
  const double times[] = {1, 2, 3, 4, 5, 7}, values[] = {5, 6, 6, 5, 5, 6};
  for (int k = 0; k < 6; ++k) CHECK(square.before(times[k]) == values[k]);
  for (const double t : {1.0, 1.25, 1.5, 3.5, 4.5}) CHECK(slope.before(t) == slope.at(t));
  CHECK(wave("PULSE(0 2 0.25 0 0.05 0.2 0.5)").before(0.75) == 0);
  CHECK(wave("PULSE(0 5 0 0.1 0.1 0.1 0.3)").at(0.65) == Approx(2.5));  // a train without a pause: its parts are longer than its period by rounding
}

TEST_CASE("The knots of a waveform come one after the other, and jumps are told from bends") {
  const auto knots = [](const std::string& text, double end) {
    std::vector<std::pair<double, bool>> all;
    bs::Knot next = wave(text).next_knot(0);
    for (; next.time <= end && all.size() < 100; next = wave(text).next_knot(next.time)) all.emplace_back(next.time, next.jumps);
    return all;
  };
  using Knots = std::vector<std::pair<double, bool>>;
  CHECK(knots("2", 10).empty());
  CHECK(knots("step(3)", 10).empty());  // it has jumped already
  CHECK(knots("step(3,2,1)", 10) == Knots{{2, true}});
  CHECK(knots("pulse(amp=4,t0=1,rise=0.5,width=2,fall=1)", 10) == Knots{{1, false}, {1.5, false}, {3.5, false}, {4.5, false}});
  CHECK(knots("pulse(amp=1,t0=0.1,width=0.2,period=0.5)", 0.9) == Knots{{0.1, true}, {0.1 + 0.2, true}, {0.1 + 0.5, true}, {0.1 + 0.5 + 0.2, true}});
  CHECK(knots("pulse(amp=1,t0=0,width=2,period=2)", 3) == Knots{{2, false}});  // from one pulse into the next
  CHECK(knots("sine(amp=1,freq=2,delay=3)", 10) == Knots{{3, false}});
  CHECK(knots("exp(0,1,1,0.1,2,0.1)", 10) == Knots{{1, false}, {2, false}});
  CHECK(knots("pwl(0,0,1,5,4,2)", 10) == Knots{{1, false}, {4, false}});
  CHECK(knots("pulse(amp=1,t0=1,rise=1e-12,width=1,fall=0)", 10).size() == 2);  // a rise that is lost in the rounding of t = 1 s
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

// times and values of v(1) from ngspice 39.3: "V1 1 0 TEXT", "R1 1 0 1", ".tran TSTEP TSTOP", then `ngspice -b` with
// "write" at numdgt=15; rise and fall 0, which ngspice would replace by TSTEP, are not among them
TEST_CASE("SPICE's form: the values of ngspice") {
  struct Case {
    const char* text;
    std::vector<std::pair<double, double>> values;
  };
  const Case cases[] = {
      {"SIN(0.5 2 1k 0.2m 300 30)",
       {{0.0001056, 1.5},
        {0.0002256, 1.75481726907701},
        {0.0005056, 1.67256465766279},
        {0.000765600000000001, -0.858835474510468},
        {0.000985600000000001, -0.659042423452262}}},
      {"sine( 1 -2m 2MEGHz )", {{1.028e-07, 0.998077322738146}, {2.028e-07, 0.998882077258588}, {4.028e-07, 1.00187919414821}}},
      {"PULSE(1 5 0.1m 0.1m 0.2m 0.3m 1m)",
       {{5.632e-05, 1},
        {0.000135, 2.4},
        {0.000325, 5},
        {0.000575, 3.5},
        {0.000925, 1},
        {0.001115, 1.6},
        {0.001625, 2.5},
        {0.001975, 1},
        {0.002175, 4}}},
      {"Pulse (-1 1V 0.2ms 10us 20us)", {{0.0001014, -1}, {0.0002035, -0.299999999999999}, {0.0002975, 1}, {0.000497500000000001, 1}}},
      {"EXP(1 4 0.1m 0.2m 0.5m 0.1m)",
       {{5.12e-05, 1}, {0.0002012, 2.19129288548847}, {0.0004512, 3.4817967355773}, {0.0007012, 1.25269517434905}, {0.0009512, 0.990392741466117}}},
      {"PWL(0.1m 2, 0.3m 5, 0.6m -1)", {{5.12e-05, 2}, {0.000225, 3.875}, {0.000375, 3.5}, {0.000525, 0.499999999999999}, {0.000875, -1}}}};
  for (const Case& c : cases)
    for (const auto& [t, value] : c.values) {
      INFO(c.text << " at " << t);
      CHECK(wave(c.text).at(t) == Approx(value).epsilon(1e-12));
    }
}

// the same, of PWL(0 NUMBER 1m NUMBER)
TEST_CASE("SPICE's numbers: suffixes and units") {
  const std::pair<const char*, double> numbers[] = {{"1A", 1},     {"2MIL", 5.08e-5}, {"3MEG", 3e6}, {"3megohm", 3e6}, {"5mV", 5e-3}, {"5M", 5e-3},
                                                    {"2kHz", 2e3}, {"1F", 1e-15},     {"7Volt", 7},  {"1e3k", 1e6},    {"4T", 4e12},  {"4G", 4e9},
                                                    {"4u", 4e-6},  {"4n", 4e-9},      {"4p", 4e-12}, {".5", .5},       {"5.", 5},     {"1e-3s", 1e-3},
                                                    {"2Ohm", 2},   {"+3", 3},         {"-2m", -2e-3}};
  for (const auto& [text, value] : numbers) {
    INFO(text);
    CHECK(wave("PWL(0 " + std::string(text) + " 1 0)").at(0) == Approx(value).epsilon(1e-15));
  }
  CHECK_THAT(fault("SIN(0 1 1k5)"), Catch::Contains("FREQ = '1k5' is not a number"));
  for (const char* text : {"SIN(0 nan 1k)", "SIN(0 inf 1k)", "SIN(0 - 1k)", "SIN(0 m 1k)"}) CHECK_THAT(fault(text), Catch::Contains("VA ="));
  CHECK_THAT(fault("SIN(0 1e90T 1k)"), Catch::Contains("is out of range"));
}

TEST_CASE("SPICE's form: commas keep the program's order, and what SPICE would fill in is asked for") {
  CHECK(wave("sine(2,50)").at(0.005) == Approx(2).epsilon(1e-14));
  CHECK(wave("PULSE(0 5 1m)").at(0.9e-3) == 0);
  CHECK(wave("PULSE(0 5 1m)").at(1e-3) == 5);
  CHECK(wave("PULSE(0 5 1m)").at(1e6) == 5);
  CHECK_THAT(fault("SIN(0,3,200)"), Catch::Contains("SPICE's order of parameters is written with blanks"));
  CHECK_THAT(fault("sin(0,3,200)"), Catch::Contains("with commas write sine(...)"));
  CHECK_THAT(fault("SIN(0 3, 200)"), Catch::Contains("commas and blanks are mixed"));
  CHECK_THAT(fault("SIN(0 3)"), Catch::Contains("FREQ is missing"));
  CHECK_THAT(fault("SIN(0 3 0)"), Catch::Contains("FREQ is 0"));
  CHECK_THAT(fault("EXP(0 3 0 1m)"), Catch::Contains("TD2 is missing"));
  CHECK_THAT(fault("PULSE(0 5 0 1m 1m 1m 2m)"), Catch::Contains("period is shorter"));
  CHECK_THAT(fault("PULSE(0 5 0 0 0 1m 2m 7)"), Catch::Contains("too many parameters"));
  CHECK_THAT(fault("PWL(0 1 2)"), Catch::Contains("do not form pairs"));
  CHECK_THAT(fault("PWL(1m 1 0.9m 2)"), Catch::Contains("is not after the one before"));
  CHECK_THAT(fault("SFFM(0 1 1k 5 100)"), Catch::Contains("SIN, PULSE, EXP and PWL"));
  CHECK_THAT(fault("step(1 2)"), Catch::Contains("with commas"));
}

TEST_CASE("An amplitude of 0 is remarked on") {
  CHECK_THAT(wave("sine(0,3,200)").remark(), Catch::Contains("its amplitude is 0") && Catch::Contains("SIN(VO VA FREQ)"));
  CHECK_THAT(wave("SIN(1 0 50)").remark(), Catch::Contains("it is 1 at all times"));
  for (const char* text : {"step(0)", "pulse(0,5,1,1)", "PULSE(2 2 0 0 0 1)", "exp(1,1,0,1)"})
    CHECK_THAT(wave(text).remark(), Catch::Contains("amplitude"));
  CHECK_THAT(wave("sine(3,0)").remark(), Catch::Contains("its frequency is 0"));
  for (const char* text : {"sine(1,3,200)", "step(1)", "0", "SIN(0 1 50)", "pwl(0,0,1,0)", "constant(0)"}) CHECK(wave(text).remark().empty());
}

TEST_CASE("Several waveforms, and faults that say what to write") {
  std::vector<bs::Waveform> list;
  CHECK(bs::read_waveforms("step(1); sine(1,2) ;3", &list).empty());
  CHECK(list.size() == 3);
  CHECK_THAT(fault("stp(1)"), Catch::Contains("did you mean step?"));
  CHECK_THAT(fault("pulse(1)"), Catch::Contains("width is missing: write pulse(amp=..,t0=..,rise=..,width=.."));
  CHECK_THAT(fault("sine(1,-2)"), Catch::Contains("freq = -2"));
  CHECK_THAT(fault("step(nan)"), Catch::Contains("is not a number"));
  for (const char* text : {"sine(1,01e308,1)", "1e308", "1e999", "step(1e-300)", "pwl(0,1,1e200,1)"})
    CHECK_THAT(fault(text), Catch::Contains("is out of range: write 0, or a number of 1e-100 to 1e100"));
  CHECK_THAT(fault("exp(0,1,2,1,1,1)"), Catch::Contains("t2 lies before t1"));
  CHECK_THAT(fault("pwl()"), Catch::Contains("do not form pairs"));
  CHECK_THAT(fault(""), Catch::Contains("write a number"));
  CHECK_THAT(fault("("), Catch::Contains("write a number"));
}

TEST_CASE("Any text is read or refused, and what is read is finite") {
  std::mt19937 random(5);
  const std::string letters = "stepulinxcoa()=,;.-+0123456789e mMk";
  const char* const seeds[] = {"pulse(amp=5,t0=1,rise=1,width=2,fall=1,period=9)",
                               "exp(0,1,0,1)",
                               "pwl(0,0,1,1)",
                               "sine(1,2)",
                               "step(1)",
                               "SIN(0 3 20 1 5 90)",
                               "PULSE(0 5 1m 1u 1u 2m 4m)",
                               "EXP(0 1 0 1 2 1)"};
  int read = 0;
  for (int k = 0; k < 20000; ++k) {
    std::string text = seeds[random() % 8];
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
