// What the tests of sessions share.
#pragma once
#include <stdlib.h>
#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <vector>

#include "base/collective.hpp"
#include "session/session.hpp"

namespace bs {

/// An error in the place of none fails the test with its text.
inline void good(const Error& error) {
  INFO(error.text);
  REQUIRE_FALSE(error);
}

inline std::unique_ptr<Session> session_of(const Settings& settings) {
  std::unique_ptr<Session> session;
  good(Session::create(MPI_COMM_WORLD, settings, &session));
  return session;
}

inline std::unique_ptr<Session> session_of(const LatticeArrays& lattice, const Settings& settings, Session::Make make = Session::Make::at_once) {
  std::unique_ptr<Session> session;
  good(Session::create(MPI_COMM_WORLD, lattice, settings, &session, make));
  return session;
}

/// Of all particles.
inline std::vector<double> array_of(Session& session, Session::Array what) {
  std::vector<double> all;
  good(session.get(what, &all));
  return all;
}

inline Settings with(Settings some, const Settings& more) {
  some.insert(some.end(), more.begin(), more.end());
  return some;
}

/// A folder of the test's own, the same on every rank.
class Folder {
 public:
  Folder() {
    char name[] = "/tmp/backspring_session_XXXXXX";
    if (rank_of(MPI_COMM_WORLD) == 0 && !mkdtemp(name)) name[0] = '\0';
    MPI_Bcast(name, sizeof name, MPI_CHAR, 0, MPI_COMM_WORLD);
    path = name;
  }
  ~Folder() {
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank_of(MPI_COMM_WORLD) == 0) (void)!system(("rm -rf " + path).c_str());
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string path;
};

}  // namespace bs
