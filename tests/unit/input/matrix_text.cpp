// Matrix Market text: every layout against the matrix it stands for, faults with their line, noise without a crash.
#include "input/matrix_text.hpp"
#include <catch2/catch.hpp>
#include <random>
#include <sstream>
#include <vector>
#include "base/handle.hpp"
#include "input/matrix_load.hpp"
#include "spoken.hpp"

namespace {

using Dense = std::vector<std::vector<double>>;

/// The matrix in `text`, repeated entries added up; `error` as the reader says.
Dense read(const std::string& text, std::string* error) {
  std::istringstream in(text);
  bs::MatrixMarketReader reader(in, "m.mtx");
  Dense m;
  if (reader.open() && reader.rows() * reader.columns() < 10000) {
    m.assign(static_cast<std::size_t>(reader.rows()), std::vector<double>(static_cast<std::size_t>(reader.columns()), 0.0));
    bs::MatrixEntry e;
    while (reader.next(&e)) m.at(static_cast<std::size_t>(e.row)).at(static_cast<std::size_t>(e.column)) += e.value;
  }
  *error = reader.error();
  return m;
}

Dense good(const std::string& text) {
  std::string error;
  const Dense m = read(text, &error);
  REQUIRE(error.empty());
  return m;
}

std::string bad(const std::string& text) {
  std::string error;
  read(text, &error);
  return error;
}

const std::string BANNER = "%%MatrixMarket matrix ";

}  // namespace

TEST_CASE("Matrix Market layouts") {
  const Dense general = {{1, 0, -2.5}, {0, 0, 3}};
  CHECK(good(BANNER + "coordinate real general\n2 3 3\n1 1 1\n1 3 -2.5\n2 3 3\n") == general);
  CHECK(good(BANNER + "array real general\n2 3\n1\n0\n0\n0\n-2.5\n3\n") == general);
  CHECK(good(BANNER + "array real general\n2 3\n1 0 0\n0 -2.5 3") == general);                          // several a line, no end of line
  CHECK(good(BANNER + "coordinate integer general\n2 2 2\n2 1 7\n2 1 -3\n") == Dense{{0, 0}, {4, 0}});  // repeated: added
  CHECK(good(BANNER + "coordinate pattern general\n2 2 1\n1 2\n") == Dense{{0, 1}, {0, 0}});
  CHECK(good(BANNER + "coordinate real symmetric\n2 2 2\n1 1 4\n2 1 5\n") == Dense{{4, 5}, {5, 0}});
  CHECK(good(BANNER + "coordinate real skew-symmetric\n2 2 1\n2 1 5\n") == Dense{{0, -5}, {5, 0}});
  CHECK(good(BANNER + "array real symmetric\n3 3\n1\n2\n3\n4\n5\n6\n") == Dense{{1, 2, 3}, {2, 4, 5}, {3, 5, 6}});
  CHECK(good(BANNER + "array real skew-symmetric\n3 3\n1\n2\n3\n") == Dense{{0, -1, -2}, {1, 0, -3}, {2, 3, 0}});
  CHECK(good(BANNER + "array real skew-symmetric\n1 1\n") == Dense{{0}});
  CHECK(good(BANNER + "coordinate real general\n2 2 0\n") == Dense{{0, 0}, {0, 0}});
}

TEST_CASE("Matrix Market: comments, blanks, case, line ends") {
  CHECK(good("%%matrixmarket MATRIX Coordinate REAL General\r\n% a\r\n\r\n  1 1 1 \r\n%b\r\n\t1   1\t+1.5E+1 \r\n%c\n") == Dense{{15}});
}

TEST_CASE("Matrix Market faults name the line and the remedy") {
  CHECK_THAT(bad(""), Catch::Contains("begin the file with"));
  CHECK_THAT(bad(BANNER + "coordinate real general\n%\n2 2 1\n3 1 1\n"), Catch::Contains("m.mtx line 4: entry (3, 1) lies outside 2 x 2"));
  CHECK_THAT(bad(BANNER + "coordinate real general\n2 2 2\n1 1 1\n"), Catch::Contains("after 1 of 2 entries"));
  CHECK_THAT(bad(BANNER + "coordinate real general\n2 2 1\n1 1 1\n1 1 1\n"), Catch::Contains("more entries than the 1"));
  CHECK_THAT(bad(BANNER + "coordinate real general\n1 1 1\n1 1 0x1\n"), Catch::Contains("write 'row column value'"));
  CHECK_THAT(bad(BANNER + "coordinate real general\n1 1 1\n1 1 inf\n"), Catch::Contains("not finite"));
  CHECK_THAT(bad(BANNER + "array real general\n1 1\n1 2\n"), Catch::Contains("more entries than the 1"));
  CHECK_THAT(bad(BANNER + "array real symmetric\n2 2\n1\n2\n"), Catch::Contains("after 2 values"));
  CHECK_THAT(bad(BANNER + "coordinate real symmetric\n2 2 1\n1 2 1\n"), Catch::Contains("lower triangle"));
}

TEST_CASE("Matrix Market: a damaged file gives a matrix or one line of error") {
  const std::string whole = BANNER + "coordinate real symmetric\n% c\n3 3 4\n1 1 1.5\n2 1 -2\n3 3 4e0\n3 1 1\n";
  std::mt19937 random(11);
  int refused = 0;
  for (int k = 0; k < 20000; ++k) {
    std::string text = whole;
    for (unsigned edits = 1 + static_cast<unsigned>(random() % 3); edits > 0; --edits) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0: text[at] = static_cast<char>(random() % 256); break;
        case 1: text.erase(at, 1 + random() % 5); break;
        case 2: text.insert(at, 1, "0123456789 .-\n%e"[random() % 16]); break;
        default: text.resize(at + 1);
      }
      if (text.empty()) break;
    }
    std::string error;
    const Dense m = read(text, &error);
    CHECK(error.find('\n') == std::string::npos);
    if (!error.empty()) ++refused;
    else CHECK(!m.empty());
  }
  CHECK(refused > 10000);
}

TEST_CASE("Vectors as CSV") {
  std::vector<double> values;
  std::vector<std::string> names;
  CHECK(bs::read_vector_csv("name,value\nv1,1.5\n# c\nv2,-2\n", "x.csv", &values, &names).empty());
  CHECK(values == std::vector<double>{1.5, -2});
  CHECK(names == std::vector<std::string>{"v1", "v2"});
  values.clear();
  names.clear();
  CHECK(bs::read_vector_csv("1\n2\n", "x.csv", &values, &names).empty());
  CHECK(values == std::vector<double>{1, 2});
  CHECK(names.empty());
  CHECK_THAT(bs::read_vector_csv("1\nx\n", "x.csv", &values, &names), Catch::Contains("x.csv line 2"));
  values.clear();
  CHECK_THAT(bs::read_vector_csv("a,1\n2\n", "x.csv", &values, &names), Catch::Contains("give all or none"));
  values.clear();
  CHECK_THAT(bs::read_vector_csv("", "x.csv", &values, &names), Catch::Contains("no numbers"));
}

TEST_CASE("A matrix larger than one piece arrives whole on every number of ranks") {
  const int rank = rank_of(PETSC_COMM_WORLD);
  const PetscInt n = 50000;  // 3n - 2 entries, more than two pieces
  const std::string path = "/tmp/backspring_test_" + std::to_string(getppid()) + ".mtx";
  if (rank == 0) {
    std::FILE* f = std::fopen(path.c_str(), "w");
    std::fprintf(f, "%%%%MatrixMarket matrix coordinate real symmetric\n%d %d %d\n", int(n), int(n), int(2 * n - 1));
    // from the last row to the first: pieces do not come in the order of the ranks
    for (int i = int(n); i >= 1; --i) {
      std::fprintf(f, "%d %d %d\n", i, i, 2 * i);
      if (i > 1) std::fprintf(f, "%d %d %d\n", i, i - 1, -i);
    }
    std::fclose(f);
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  bs::MatHandle A;
  REQUIRE(bs::load_matrix(PETSC_COMM_WORLD, path, "-test", A.out()) == 0);
  bs::VecHandle x, y;
  REQUIRE(MatCreateVecs(A, x.out(), y.out()) == 0);
  VecSet(x, 1);
  MatMult(A, x, y);
  PetscInt first, last;
  const PetscScalar* ay;
  VecGetOwnershipRange(y, &first, &last);
  VecGetArrayRead(y, &ay);
  int wrong = 0;
  for (PetscInt i = first; i < last; ++i) {
    // row i (from 1): 2i - i - (i + 1), the first without its left, the last without its right neighbour
    const double k = double(i + 1), expected = 2 * k - (i > 0 ? k : 0) - (i + 1 < n ? k + 1 : 0);
    wrong += ay[i - first] != expected;
  }
  VecRestoreArrayRead(y, &ay);
  CHECK(wrong == 0);
  MPI_Barrier(PETSC_COMM_WORLD);
  if (rank == 0) std::remove(path.c_str());
}
