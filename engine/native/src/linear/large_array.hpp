// A vector for arrays that are walked through once per step. Beyond a few megabytes the walk through the page table costs
// as much as the numbers themselves, so large ones ask the kernel for large pages.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace spook {

template <class T> struct LargePages {
    using value_type = T;
    static constexpr std::size_t page = std::size_t{1} << 21, threshold = page / 4;
    LargePages() = default;
    template <class U> LargePages(const LargePages<U>&) noexcept {}

    T* allocate(std::size_t count) {
        const std::size_t bytes = count * sizeof(T);
        if (bytes < threshold) return static_cast<T*>(::operator new(bytes, small()));
        const std::size_t rounded = (bytes + page - 1) / page * page;
        void* memory = ::operator new(rounded, std::align_val_t{page});
#if defined(__linux__) && defined(MADV_HUGEPAGE)
        ::madvise(memory, rounded, MADV_HUGEPAGE);  // a wish: where it is refused, small pages do
#endif
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t count) noexcept {
        if (count * sizeof(T) < threshold) ::operator delete(static_cast<void*>(memory), small());
        else ::operator delete(static_cast<void*>(memory), std::align_val_t{page});
    }
    static constexpr std::align_val_t small() noexcept {
        return std::align_val_t{std::max(alignof(T), alignof(std::max_align_t))};
    }
    template <class U> bool operator==(const LargePages<U>&) const noexcept { return true; }
};

template <class T> using LargeArray = std::vector<T, LargePages<T>>;

}  // namespace spook
