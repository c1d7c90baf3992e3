// A state as bytes, to go on from in another process: every field of it, found by the compiler.
//
// A record is written as its fields, an array as its items, and what is plain memory as that. Each says what it is and how
// large, so that bytes of a build whose state has other fields are refused. No list names the fields: a new one of a
// record is in, though a record of a new number of fields may need its line in `each` below.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace spook {

namespace fields {

/// Becomes whatever a field is: so many of them as make a record are its fields.
struct Anything {
    template <class T> operator T() const;
};
template <class Record, std::size_t... I> constexpr bool takes(std::index_sequence<I...>) {
    return requires { Record{(static_cast<void>(I), Anything{})...}; };
}
template <class Record, std::size_t N = 0> constexpr std::size_t count() {
    if constexpr (takes<Record>(std::make_index_sequence<N + 1>{})) return count<Record, N + 1>();
    else return N;
}

/// `visit` is called with each field of an aggregate, in order.
template <class Record, class Visit> void each(Record& record, Visit visit) {
    constexpr std::size_t N = count<std::remove_const_t<Record>>();
    const auto all = [&visit](auto&... field) { (visit(field), ...); };
    if constexpr (N == 1) {
        auto& [a] = record;
        all(a);
    } else if constexpr (N == 2) {
        auto& [a, b] = record;
        all(a, b);
    } else if constexpr (N == 3) {
        auto& [a, b, c] = record;
        all(a, b, c);
    } else if constexpr (N == 4) {
        auto& [a, b, c, d] = record;
        all(a, b, c, d);
    } else if constexpr (N == 5) {
        auto& [a, b, c, d, e] = record;
        all(a, b, c, d, e);
    } else if constexpr (N == 6) {
        auto& [a, b, c, d, e, f] = record;
        all(a, b, c, d, e, f);
    } else if constexpr (N == 7) {
        auto& [a, b, c, d, e, f, g] = record;
        all(a, b, c, d, e, f, g);
    } else if constexpr (N == 8) {
        auto& [a, b, c, d, e, f, g, h] = record;
        all(a, b, c, d, e, f, g, h);
    } else if constexpr (N == 29) {
        auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab, ac] =
            record;
        all(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, ab, ac);
    } else {
        static_assert(N == 0, "a record of so many fields needs a line here");
    }
}

template <class T> inline constexpr bool is_plain = std::is_trivially_copyable_v<T>;
template <class T> inline constexpr bool is_array = requires(T& t) { t.resize(t.size()), t.data(); };
template <class T>
inline constexpr bool is_pair = requires(T& t) { t.first, t.second; } && !std::is_aggregate_v<T>;

enum class Kind : std::uint8_t { plain = 1, plains, items, record };

}  // namespace fields

class StateWriter {
public:
    template <class T> void put(const T& value) {
        using namespace fields;
        if constexpr (is_plain<T>) {
            head(Kind::plain, sizeof(T));
            append(&value, sizeof(T));
        } else if constexpr (is_array<T>) {
            using Item = typename T::value_type;
            head(is_plain<Item> ? Kind::plains : Kind::items, value.size());
            if constexpr (is_plain<Item>) {
                append(sizeof(Item));
                append(value.data(), value.size() * sizeof(Item));
            } else {
                for (const Item& item : value) put(item);
            }
        } else if constexpr (is_pair<T>) {
            head(Kind::record, 2);
            put(value.first), put(value.second);
        } else {
            head(Kind::record, count<T>());
            each(value, [this](const auto& field) { put(field); });
        }
    }
    std::string bytes;

private:
    void head(fields::Kind kind, std::uint64_t count) {
        append(&kind, 1);
        append(count);
    }
    void append(std::uint64_t number) { append(&number, sizeof number); }
    void append(const void* from, std::size_t size) { bytes.append(static_cast<const char*>(from), size); }
};

/// Throws std::invalid_argument for bytes that are not of such a state, whatever they are.
class StateReader {
public:
    explicit StateReader(std::string_view bytes) : left_(bytes) {}

    template <class T> void get(T& value) {
        using namespace fields;
        if constexpr (is_plain<T>) {
            expect(head(Kind::plain) == sizeof(T));
            take(&value, sizeof(T));
        } else if constexpr (is_array<T>) {
            using Item = typename T::value_type;
            const std::uint64_t count = head(is_plain<Item> ? Kind::plains : Kind::items);
            if constexpr (is_plain<Item>) {
                expect(number() == sizeof(Item) && count <= left_.size() / sizeof(Item));
                value.resize(count);
                take(value.data(), count * sizeof(Item));
            } else {
                expect(count <= left_.size());
                value.resize(count);
                for (Item& item : value) get(item);
            }
        } else if constexpr (is_pair<T>) {
            expect(head(Kind::record) == 2);
            get(value.first), get(value.second);
        } else {
            expect(head(Kind::record) == count<T>());
            each(value, [this](auto& field) { get(field); });
        }
    }
    void expect_end() const { expect(left_.empty()); }

private:
    static void expect(bool right) {
        if (!right)
            throw std::invalid_argument(
                "these bytes are no state of this build of the engine; save the run again");
    }
    std::uint64_t head(fields::Kind kind) {
        fields::Kind found{};
        take(&found, 1);
        expect(found == kind);
        return number();
    }
    std::uint64_t number() {
        std::uint64_t value = 0;
        take(&value, sizeof value);
        return value;
    }
    void take(void* to, std::size_t size) {
        expect(size <= left_.size());
        if (size > 0) std::memcpy(to, left_.data(), size);
        left_.remove_prefix(size);
    }

    std::string_view left_;
};

template <class State> std::string to_bytes(const State& state) {
    StateWriter writer;
    writer.put(state);
    return std::move(writer.bytes);
}

template <class State> State from_bytes(std::string_view bytes) {
    State state;
    StateReader reader(bytes);
    reader.get(state);
    reader.expect_end();
    return state;
}

}  // namespace spook
