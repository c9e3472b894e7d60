// Motion of anchor points, and the tables it may come from.
#include "physics/whole/motion.hpp"
#include "base/options.hpp"
#include "laws_common.hpp"
#include "physics/vector.hpp"

using namespace bs;
using namespace law_tests;

namespace {

/// s'(t) agrees with differences of s(t) at t.
void check_velocity(const Motion& motion, double t, double h = 1e-3) {
  double s[3], v[3], unused[3];
  motion.at(t, s, v);
  const auto shift = [&](double* there) { motion.at(t, there, unused); };
  require_close(v, differences(&t, 1, 3, h, shift), 1e-9, 1e-3);
}

void set(Motion* motion) {
  std::string error;
  motion->drive = Drive();
  INFO(motion->text(3));
  REQUIRE(motion->drive.parse(motion->text(3), 3, &error));
}

Motion table_of(const std::string& text) {
  CsvTable table;
  std::string error;
  Motion motion;
  motion.kind = Motion::Kind::table;
  motion.table_file = "t.csv";
  set(&motion);
  REQUIRE(read_csv_table(text, "t.csv", 2, 4, &table, &error));
  REQUIRE(motion.drive.set_table(0, table, &error));
  return motion;
}

std::string error_of(const std::string& text, int least = 2, int most = 4) {
  CsvTable table;
  std::string error = "left from before";
  const bool read = read_csv_table(text, "m.csv", least, most, &table, &error);
  REQUIRE(read == error.empty());
  REQUIRE(read == (table.rows() > 0));
  REQUIRE(error.find('\n') == std::string::npos);
  return error;
}

}  // namespace

TEST_CASE("motion: velocity is ds/dt; where it starts") {
  Dice dice(101);
  Motion fixed, steady, wave;
  REQUIRE_FALSE(fixed.active());
  steady.kind = Motion::Kind::velocity;
  wave.kind = Motion::Kind::sinusoid;
  for (int n = 0; n < 50; ++n) {
    for (int i = 0; i < 3; ++i) {
      steady.c[i] = dice.between(-2, 2);
      wave.A[i] = dice.between(-2, 2);
    }
    wave.frequency = dice.between(0.1, 2);
    wave.phase = dice.between(-3, 3);
    set(&steady);
    set(&wave);
    const double t = dice.between(-1, 5);
    check_velocity(fixed, t);
    check_velocity(steady, t);
    check_velocity(wave, t, 2e-4);
    double s[3], ds[3], v[3];
    steady.at(2, s, ds);
    wave.at(0, v, ds);
    for (int i = 0; i < 3; ++i) REQUIRE(s[i] == 2 * steady.c[i]);
    for (int i = 0; i < 3; ++i) REQUIRE(v[i] == Approx(wave.A[i] * std::sin(wave.phase)).margin(1e-15));
    for (int i = 0; i < 3; ++i) REQUIRE(ds[i] == Approx(wave.A[i] * TWO_PI * wave.frequency * std::cos(wave.phase)));
    wave.at(1 / wave.frequency + t, s, ds);  // its period
    wave.at(t, v, ds);
    for (int i = 0; i < 3; ++i) REQUIRE(s[i] == Approx(v[i]).margin(1e-13));
    wave.at_rest = wave.at_full_load = true;
    wave.at(t, s, ds);
    for (int i = 0; i < 3; ++i) REQUIRE((ds[i] == 0 && s[i] == Approx(wave.A[i] * std::sin(TWO_PI * wave.frequency + wave.phase)).margin(1e-14)));
    wave.at_rest = wave.at_full_load = false;
  }
}

TEST_CASE("motion by a table: exact at its rows, linear between, slopes to the right") {
  const Motion m = table_of("t,x,y\n0.1, 0.3, -1\n0.4, 0.7, 0.1\n1.3 -0.2 0.3\n");
  const double t[] = {0.1, 0.4, 1.3}, x[] = {0.3, 0.7, -0.2}, y[] = {-1, 0.1, 0.3};
  double s[3], v[3];
  for (int k = 0; k < 3; ++k) {
    m.at(t[k], s, v);
    const int from = std::min(k, 1);  // the last row has no right
    REQUIRE((s[0] == x[k] && s[1] == y[k] && s[2] == 0));
    REQUIRE(v[0] == Approx((x[from + 1] - x[from]) / (t[from + 1] - t[from])).epsilon(1e-14));
    REQUIRE(v[1] == Approx((y[from + 1] - y[from]) / (t[from + 1] - t[from])).epsilon(1e-14));
  }
  m.at(0.25, s, v);
  REQUIRE(s[0] == Approx(0.5 * (0.3 + 0.7)).epsilon(1e-14));
  Dice dice(102);
  for (int n = 0; n < 50; ++n) {
    check_velocity(m, dice.between(0.11, 0.39));
    check_velocity(m, dice.between(0.41, 1.29));
  }
  m.at(0.4 - 1e-9, s, v);
  REQUIRE(v[0] == Approx((0.7 - 0.3) / 0.3));
  m.at(std::nextafter(0.4, 0.0), s, v);  // a sum of steps that is to be 0.4
  REQUIRE(v[0] == Approx((-0.2 - 0.7) / 0.9));
}

TEST_CASE("motion by a table: what it covers, and where it stays beyond") {
  const Motion m = table_of("1 5\n2 7\n");
  REQUIRE((m.drive.misses(1).empty() && m.drive.misses(1.5).empty() && m.drive.misses(2 + 1e-12).empty()));
  REQUIRE((!m.drive.misses(0.999999).empty() && !m.drive.misses(2.000001).empty()));
  double s[3], v[3];
  m.at(3, s, v);
  REQUIRE((s[0] == 7 && v[0] == 0));
  m.at(0, s, v);
  REQUIRE((s[0] == 5 && v[0] == 0));
}

TEST_CASE("csv: what is read") {
  CsvTable table;
  std::string error;
  const std::string forms[] = {"0,1.5\n1,-2e-3\n", "time [s],x\r\n0,1.5\r\n1,-2e-3\r\n",
                               "\xEF\xBB\xBF# of a run\n\n  t x\n 0 \t +1.5 # start\n1 , -0.002", "t;x\n0 1.5\n\n1 -.2e-2\n#end"};
  for (const std::string& text : forms) {
    INFO(text);
    REQUIRE(read_csv_table(text, "t.csv", 2, 4, &table, &error));
    REQUIRE(error.empty());
    REQUIRE(table.columns == 2);
    REQUIRE(table.values == std::vector<double>{0, 1.5, 1, -2e-3});
  }
  REQUIRE(read_csv_table("0.1,1e-300,3,-4\n", "t.csv", 2, 4, &table, &error));
  REQUIRE((table.columns == 4 && table.rows() == 1 && table.values[1] == 1e-300));
}

TEST_CASE("csv: what is refused, with file, line and remedy") {
  const struct {
    const char *text, *says;
  } cases[] = {
      {"", "m.csv: no rows of numbers: write"},
      {"t,x\n# nothing\n", "m.csv: no rows of numbers: write"},
      {"0,1\n1,two\n", "m.csv line 2: column 2 'two' is not a number: write"},
      {"t,x\n0,1\nt,x\n", "m.csv line 3: column 1 't' is not a number"},
      {"t,1\n", "m.csv line 1: column 1 't' is not a number"},
      {"0,1\n\n1,nan\n", "m.csv line 3: column 2 'nan' is not finite: write"},
      {"0,1\n1,-inf\n", "m.csv line 2: column 2 '-inf' is not finite"},
      {"nan,1\n", "m.csv line 1: column 1 'nan' is not finite"},
      {"0,1e999\n", "m.csv line 1: column 2 '1e999' is out of the range"},
      {"0,0x10\n", "'0x10' is not a number"},
      {"0,1e\n", "'1e' is not a number"},
      {"0,+-1\n", "'+-1' is not a number"},
      {"0,1\n0,2\n", "m.csv line 2: time 0 is not after 0 of the row above: write"},
      {"0,1\n2,2\n1,3\n", "m.csv line 3: time 1 is not after 2"},
      {"0,1\n1\n", "m.csv line 2: 1 number in the row: write 2, as in the rows above"},
      {"0,1\n1,2,3\n", "m.csv line 2: 3 numbers in the row: write 2, as in the rows above"},
      {"0\n", "m.csv line 1: 1 number in the row: write 2 to 4"},
      {"0,1,2,3,4\n", "m.csv line 1: 5 numbers in the row: write 2 to 4"},
      {"0,,1\n", "m.csv line 1: column 2 is empty"},
      {"0,1,\n", "m.csv line 1: column 3 is empty"},
      {",\n", "m.csv line 1: column 1 is empty"},
      {"0,\x01\x1b[31m\n", "column 2 '??[31m' is not a number"},
  };
  for (const auto& c : cases) {
    const std::string error = error_of(c.text);
    INFO(c.text << " -> " << error);
    REQUIRE(error.find(c.says) != std::string::npos);
  }
  REQUIRE(error_of("0,1,2\n", 2, 2).find("write 2") != std::string::npos);
  REQUIRE(error_of("0," + std::string(100000, '9') + "x\n").size() < 200);
  REQUIRE(error_of(std::string(100000, ',')).size() < 200);
  REQUIRE_FALSE(error_of(std::string("0,1\0", 4)).empty());
}

TEST_CASE("csv: random text is read or refused, never more") {
  std::mt19937 random(7);
  const std::string letters = "0123456789.,,,   \t\n\n\r+-eEninf#tx\xEF\xBB\xBF";
  int read = 0;
  for (int n = 0; n < 20000; ++n) {
    std::string text;
    for (auto k = random() % 24; k > 0; --k) text += random() % 50 ? letters[random() % letters.size()] : static_cast<char>(random() % 256);
    CsvTable table;
    std::string error;
    if (!read_csv_table(text, "r.csv", 1, 3, &table, &error)) {
      REQUIRE(error.find("r.csv") == 0);
      continue;
    }
    ++read;
    REQUIRE((table.rows() > 0 && table.values.size() == table.rows() * static_cast<std::size_t>(table.columns)));
    for (std::size_t k = 0; k < table.values.size(); ++k) REQUIRE(std::isfinite(table.values[k]));
    for (std::size_t k = 1; k < table.rows(); ++k)
      REQUIRE(table.values[k * static_cast<std::size_t>(table.columns)] > table.values[(k - 1) * static_cast<std::size_t>(table.columns)]);
  }
  REQUIRE(read > 100);
}
