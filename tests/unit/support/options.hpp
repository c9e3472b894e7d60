// Options that are set while a test needs them, and models made from options.
#pragma once
#include <petscsys.h>
#include <catch2/catch.hpp>
#include <map>
#include <memory>
#include <string>

#include "systems/create.hpp"

using OptionTexts = std::map<std::string, std::string>;

/// Options without a value have the text "".
class Given {
 public:
  explicit Given(OptionTexts texts) : texts_(std::move(texts)) {
    for (const auto& [name, text] : texts_) REQUIRE(PetscOptionsSetValue(nullptr, name.c_str(), text.empty() ? nullptr : text.c_str()) == 0);
  }
  ~Given() {
    for (const auto& [name, text] : texts_) (void)PetscOptionsClearValue(nullptr, name.c_str());
  }
  Given(const Given&) = delete;
  Given& operator=(const Given&) = delete;

 private:
  OptionTexts texts_;
};

/// The model that the options ask for. `texts` are not among the options afterwards.
inline std::unique_ptr<bs::Model> model_of(const OptionTexts& texts, MPI_Comm comm = PETSC_COMM_WORLD) {
  const Given given(texts);
  std::unique_ptr<bs::Model> model;
  REQUIRE(bs::create_model(comm, &model) == 0);
  return model;
}
