// Long work comes in pieces, so that the caller that asked for it can end it in time.
#pragma once

namespace spook {

/// Called between the pieces of a factorisation or an ordering, some milliseconds of work each, if it is set in this
/// thread. It may throw: what was being made is then unfinished, and has to be made again.
inline thread_local void (*between_pieces)() = nullptr;

inline void end_piece() {
    if (between_pieces != nullptr) between_pieces();
}

}  // namespace spook
