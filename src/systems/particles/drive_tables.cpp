#include "systems/particles/drive_tables.hpp"

#include "base/fault.hpp"
#include "base/find_file.hpp"
#include "input/text_file.hpp"

namespace bs {

PetscErrorCode read_drive_tables(MPI_Comm comm, const std::string& option, Drive* drive) {
  std::string error;

  PetscFunctionBegin;
  for (std::size_t k = 0; k < drive->tables().size(); ++k) {
    std::string file = drive->tables()[k].first, content;
    CsvTable table;
    PetscCall(find_input(comm, option, &file));
    PetscCall(read_text_file(comm, file, &content));
    if (!read_csv_table(content, file, 2, 1 + drive->tables()[k].second, &table, &error) || !drive->set_table(k, table, &error))
      PetscCall(tell(comm, Exit::input, error));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
