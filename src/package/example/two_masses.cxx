// Two masses on a line and a spring between them, made in memory, stretched and released: no file, no command line.
#include <cstdio>
#include <memory>
#include <vector>

#include <backspring/backspring.hpp>

static bs::Error run() {
  bs::LatticeArrays two;
  two.dim = 1;
  two.position = {-0.1, 1.1};  // [m]
  two.mass = {2, 2};           // [kg]
  two.springs = {0, 1};
  two.stiffness = {50};                                                        // [N/m]
  two.rest_length = {1};                                                       // [m]
  const bs::Settings settings = {{"-ts_type", "beuler"}, {"-ts_dt", "0.01"}};  // as on the command line

  std::unique_ptr<bs::Session> session;
  bs::Error error = bs::Session::create(MPI_COMM_WORLD, two, settings, &session);
  std::vector<double> x;
  for (int n = 0; n < 10 && !error; ++n) {
    error = session->step();
    if (!error) error = session->get(bs::Session::Array::position, &x);
    if (!error) std::printf("%.17g %.17g %.17g\n", session->time(), x[0], x[1]);
  }
  bs::Result modes;
  if (!error) error = session->modes(1, &modes);
  if (!error) std::printf("omega_squared %.17g\n", modes.omega_squared.at(0));  // beside the motion of both, which has none
  return error;
}

int main() {
  const bs::Library library;  // starts MPI and PETSc
  if (!library.started()) return 1;
  const bs::Error error = run();
  if (error) std::fprintf(stderr, "%s\n", error.text.c_str());
  return static_cast<int>(error ? error.exit : bs::Exit::ok);
}
