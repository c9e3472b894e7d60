#include "base/error.hpp"
#include <algorithm>
#include <sstream>
#include "base/collective.hpp"
#include "base/context.hpp"

namespace bs {

namespace {

/// The errors and warnings of one communicator.
struct Errors {
  Error last;
  Exit phase = Exit::input;
  Listener listener;
  std::vector<std::string> warned{};              ///< keys of what was warned of outside of runs
  std::vector<std::vector<std::string>*> runs{};  ///< keys of the runs that are under way, the latest one last
};

void insert(std::vector<std::string>* keys, const std::string& key) {
  if (std::find(keys->begin(), keys->end(), key) == keys->end()) keys->push_back(key);
}

/// Told to the listener before it is passed up.
PetscErrorCode hold(MPI_Comm comm, const Error& error, bool alone) {
  Errors& all = held_by<Errors>(comm);
  all.last = error;
  if (all.listener.error) all.listener.error(error, alone);
  return ERR_FAILED;
}

/// Sends the winner's text and exit code to all ranks.
PetscErrorCode broadcast(MPI_Comm comm, PetscMPIInt root, Error* error) {
  PetscMPIInt head[2] = {static_cast<PetscMPIInt>(error->text.size()), static_cast<PetscMPIInt>(error->exit)};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(head, 2, MPI_INT, root, comm));
  error->text.resize(static_cast<std::size_t>(head[0]));
  PetscCallMPI(MPI_Bcast(error->text.data(), head[0], MPI_CHAR, root, comm));
  error->exit = static_cast<Exit>(head[1]);
  PetscFunctionReturn(0);
}

/// The error with the smallest `where`, then rank, on every rank; without text if there is none.
PetscErrorCode choose(MPI_Comm comm, const Error& error, Error* chosen) {
  const bool mine = static_cast<bool>(error);
  std::int64_t first[2] = {mine ? error.where : std::numeric_limits<std::int64_t>::max(), mine ? 0 : 1};
  PetscMPIInt winner;
  PetscFunctionBegin;
  *chosen = {};
  PetscCall(min_over_ranks(comm, first, 2));
  if (first[1] != 0) PetscFunctionReturn(0);
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  winner = mine && error.where == first[0] ? rank : size;
  PetscCall(min_over_ranks(comm, &winner));
  *chosen = error;
  chosen->where = first[0];
  PetscCall(broadcast(comm, winner, chosen));
  PetscFunctionReturn(0);
}

}  // namespace

void Error::note(std::int64_t at, std::string what, Exit code) {
  if (!text.empty() && where <= at) return;
  where = at;
  text = std::move(what);
  exit = code;
}

PetscErrorCode first_error(MPI_Comm comm, const Error& error, std::string* text) {
  Error chosen;
  PetscFunctionBegin;
  PetscCall(choose(comm, error, &chosen));
  *text = chosen.text;
  PetscFunctionReturn(0);
}

PetscErrorCode fail_if_any(MPI_Comm comm, const Error& error) {
  Error chosen;
  PetscFunctionBegin;
  PetscCall(choose(comm, error, &chosen));
  PetscFunctionReturn(chosen ? hold(comm, chosen, false) : 0);
}

PetscErrorCode fail(MPI_Comm comm, Exit exit, const std::string& text) {
  Error error;
  PetscFunctionBegin;
  error.text = text;
  error.exit = exit;
  PetscFunctionReturn(hold(comm, error, false));
}

PetscErrorCode fail_here(MPI_Comm comm, Exit exit, const std::string& text) {
  Error error;
  error.text = text;
  error.exit = exit;
  return hold(comm, error, true);
}

PetscErrorCode warn(MPI_Comm comm, const std::string& key, const std::string& text) {
  Errors& all = held_by<Errors>(comm);
  PetscFunctionBegin;
  insert(all.runs.empty() ? &all.warned : all.runs.back(), key);
  if (rank_of(comm) == 0 && all.listener.warning) all.listener.warning(text);
  PetscFunctionReturn(0);
}

PetscErrorCode warn_here(MPI_Comm comm, const std::string& key, const std::string& text) { return rank_of(comm) == 0 ? warn(comm, key, text) : 0; }

const Error& last_error(MPI_Comm comm) { return held_by<Errors>(comm).last; }

void clear_error(MPI_Comm comm) { held_by<Errors>(comm).last = {}; }

Error outcome(MPI_Comm comm, PetscErrorCode code) {
  if (code == 0) return {};
  Error error = last_error(comm);
  const char* generic = nullptr;
  if (error) return error;
  (void)PetscErrorMessage(code, &generic, nullptr);
  error.text = generic ? generic : "unknown error";
  error.exit = present_phase(comm);
  return error;
}

void set_listener(MPI_Comm comm, Listener listener) { held_by<Errors>(comm).listener = std::move(listener); }

void set_phase(MPI_Comm comm, Exit phase) { held_by<Errors>(comm).phase = phase; }

Exit present_phase(MPI_Comm comm) { return held_by<Errors>(comm).phase; }

Warnings::Warnings(MPI_Comm comm) : comm_(comm), keys_(held_by<Errors>(comm).warned) { held_by<Errors>(comm).runs.push_back(&keys_); }

Warnings::~Warnings() {
  auto& runs = held_by<Errors>(comm_).runs;
  runs.erase(std::remove(runs.begin(), runs.end(), &keys_), runs.end());
}

bool Warnings::has(const std::string& key) const { return std::find(keys_.begin(), keys_.end(), key) != keys_.end(); }

PetscErrorCode Warnings::add(const std::string& key, const std::string& text) {
  PetscFunctionBegin;
  if (has(key)) PetscFunctionReturn(0);
  keys_.push_back(key);
  PetscCall(warn(comm_, key, text));
  PetscFunctionReturn(0);
}

PetscErrorCode Warnings::save(Facts* facts) const {
  std::string all;
  PetscFunctionBegin;
  for (const std::string& key : keys_) all += (all.empty() ? "" : " ") + key;
  PetscCall(share_text(comm_, &all));
  if (!all.empty()) facts->text["warnings"] = all;
  PetscFunctionReturn(0);
}

void Warnings::restore(const Facts& facts) {
  const auto saved = facts.text.find("warnings");
  if (saved == facts.text.end()) return;
  std::istringstream words(saved->second);
  for (std::string key; words >> key;) insert(&keys_, key);
}

}  // namespace bs
