// Releases a container's memory: `v = {}` would empty a vector and keep its memory.
#pragma once

namespace bs {

template <class Container>
void release(Container& container) {
  Container().swap(container);
}

}  // namespace bs
