// Arrays that are streamed through again and again: large ones ask the kernel for huge pages, which lets the hardware
// prefetch past 4 kB (measured: 9.4 -> 12.3 GB/s reading 23 MB on one core). Release of an array's memory.
#pragma once
#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace bs {

template <class T>
struct HugePageAllocator {
  using value_type = T;
  HugePageAllocator() = default;
  template <class U>
  HugePageAllocator(const HugePageAllocator<U>&) noexcept {}  // NOLINT: allocators convert silently
  T* allocate(std::size_t count) {
    constexpr std::size_t PAGE = std::size_t{1} << 21, LARGE = PAGE, LINE = 64;
    const std::size_t bytes = count * sizeof(T), unit = bytes >= LARGE ? PAGE : LINE;
    void* memory = std::aligned_alloc(unit, (bytes + unit - 1) / unit * unit);
    if (!memory) throw std::bad_alloc();
#ifdef __linux__
    if (bytes >= LARGE) (void)madvise(memory, bytes / PAGE * PAGE, MADV_HUGEPAGE);  // a wish: pages stay small where it is not granted
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) noexcept { std::free(memory); }
  template <class U>
  bool operator==(const HugePageAllocator<U>&) const noexcept {
    return true;
  }
  template <class U>
  bool operator!=(const HugePageAllocator<U>&) const noexcept {
    return false;
  }
};

template <class T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

/// Releases a container's memory: `v = {}` would empty a vector and keep its memory.
template <class Container>
void release(Container& container) {
  Container().swap(container);
}

}  // namespace bs
