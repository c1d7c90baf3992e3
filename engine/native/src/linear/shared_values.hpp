// Values by index, many of which are equal: what is read of thousands of them then stays near.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

namespace spook {

/// Each value is kept once, if it is among the last few distinct ones: a list of many is read once through.
template <class T> class SharedValues {
public:
    SharedValues() = default;
    explicit SharedValues(const std::vector<T>& values) {
        for (const T& value : values) push_back(value);
    }
    void push_back(const T& value) {
        const auto last = distinct_.end() - std::min<std::ptrdiff_t>(few, std::ssize(distinct_));
        const auto at = std::find(last, distinct_.end(), value);
        which_.push_back(static_cast<int>(at - distinct_.begin()));
        if (at == distinct_.end()) distinct_.push_back(value);
    }
    const T& operator[](std::size_t index) const noexcept { return distinct_[which_[index]]; }
    const std::vector<T>& distinct() const noexcept { return distinct_; }

private:
    static constexpr std::ptrdiff_t few = 16;
    std::vector<T> distinct_;
    std::vector<int> which_;
};

}  // namespace spook
