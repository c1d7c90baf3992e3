// Which of several builds of the same loops runs: all round alike, and the machine decides.
#pragma once

namespace spook {

inline bool has_avx2() noexcept {
#if defined(__x86_64__) && defined(__GNUC__)
    return __builtin_cpu_supports("avx2") != 0;
#else
    return false;
#endif
}

/// The portable build of a table, or the wide one where the machine has it. Not to be switched between threads.
template <class Table> class ByMachine {
public:
    ByMachine(const Table& portable, const Table& wide) noexcept : portable_(portable), wide_(wide) {
        use_portable(false);
    }
    const Table& operator*() const noexcept { return *chosen_; }
    void use(const Table& table) noexcept { chosen_ = &table; }
    void use_portable(bool portable) noexcept { use(portable || !has_avx2() ? portable_ : wide_); }

private:
    const Table &portable_, &wide_;
    const Table* chosen_;
};

}  // namespace spook
