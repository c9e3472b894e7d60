// Tables over time.
#include "common.hpp"
#include "lattice/csv_table.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of(data, size);
  for (const int most : {2, 4, 1000}) {
    bs::CsvTable table;
    std::string error;
    if (!bs::read_csv_table(text, "f.csv", 2, most, &table, &error)) {
      require_message(error, "f.csv");
      require(table.values.empty(), "a failure leaves an empty table");
      continue;
    }
    require(error.empty() && table.rows() >= 1 && table.columns >= 2 && table.columns <= most, "shape");
    require(table.rows() * static_cast<std::size_t>(table.columns) == table.values.size(), "whole rows");
    require_finite(table.values);
    const std::size_t d = static_cast<std::size_t>(table.columns);
    for (std::size_t k = d; k < table.values.size(); k += d) require(table.values[k] > table.values[k - d], "time goes on");
  }
  return 0;
}
