// Groups as options say them.
#include "lattice/groups.hpp"
#include <catch2/catch.hpp>

namespace {

bs::Lattice row_of_five(std::int64_t first, std::int64_t count) {
  bs::Lattice l;
  l.dim = 2;
  l.particles = {first, count, 5};
  for (std::int64_t k = first; k < first + count; ++k) {
    l.position.push_back(static_cast<double>(k));
    l.position.push_back(0.5 * static_cast<double>(k % 2));
  }
  return l;
}

}  // namespace

TEST_CASE("groups by faces, boxes and rows are the same in any chunks") {
  bs::GroupSpec spec;
  spec.name = "some";
  REQUIRE(bs::parse_group("xmax, ids:0 ,2-2, box:0.9, 0.4,1.1 ,0.6", 2, 2, 5, &spec).empty());
  bs::Box box;
  box.hi[0] = 4;
  box.hi[1] = 0.5;
  std::vector<int> found;
  for (const auto& [first, count] : {std::pair<std::int64_t, std::int64_t>{0, 2}, {2, 3}}) {
    bs::Lattice l = row_of_five(first, count);
    bs::choose_groups({spec}, box, 0, &l);
    REQUIRE(l.groups.size() == 1);
    for (const auto member : l.groups[0].member) found.push_back(member);
  }
  CHECK(found == std::vector<int>{1, 1, 1, 0, 1});
}

TEST_CASE("what is no group says so") {
  bs::GroupSpec spec;
  for (const char* text :
       {"", "xmid", "zmin", "ids:", "ids:5", "ids:-1", "ids:3-1", "box:0,0,1", "box:0,0,1,nan", "xmin,,xmax", "ids:1e3", "ids:1 2", "box:0,0 0,1,1"})
    CHECK_FALSE(bs::parse_group(text, 2, 2, 5, &spec).empty());
  CHECK(bs::is_group_name("left_2"));
  CHECK_FALSE(bs::is_group_name("2left"));
  CHECK_FALSE(bs::is_group_name("a b"));
}
