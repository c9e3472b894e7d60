// What a program on the library does with the systems that are made on a communicator of its session.
#pragma once

namespace bs {

/// In the context of the communicator; what nobody says is not done.
struct Client {
  bool moves_groups = false;     ///< it says where groups are whose motion is `given`
  bool gives_histories = false;  ///< histories are put into systems once these are made, as a restart does
  bool changes_numbers = false;  ///< systems have room for springs that exert nothing yet, and are given other numbers later
};

}  // namespace bs
