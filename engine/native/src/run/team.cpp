#include "run/team.hpp"

#include <algorithm>

#if !defined(__wasi__)
#include <unistd.h>
#endif

namespace spook {

#if defined(__wasi__)

Team::Team(int) {}
Team::~Team() = default;
void Team::refresh() {}
void Team::begin(Call, const void*) noexcept {}
bool Team::done() noexcept { return true; }
void Team::meet() noexcept {}

#else

namespace {

constexpr int awake =
    4000;  // rounds that a thread waits before it sleeps and another process may have the core

void pause() noexcept {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
}

}  // namespace

Team::Team(int size) : size_(std::max(1, size)) { start(); }

void Team::start() {
    process_ = static_cast<long>(::getpid());
    for (int part = 1; part < size_; ++part) threads_.emplace_back([this, part] { serve(part); });
}

Team::~Team() {
    if (threads_.empty()) return;
    if (process_ != static_cast<long>(::getpid())) {  // after a fork: theirs, not ours to wait for
        for (std::thread& thread : threads_) thread.detach();
        return;
    }
    ending_ = true;
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void Team::refresh() {
    if (size_ == 1 || process_ == static_cast<long>(::getpid())) return;
    for (std::thread& thread : threads_) thread.detach();
    threads_.clear();
    round_ = 0;
    busy_ = 0;
    start();
}

void Team::begin(Call call, const void* work) noexcept {
    if (size_ == 1) return;
    call_ = call;
    work_ = work;
    busy_.store(size_ - 1, std::memory_order_relaxed);
    arrived_.store(0, std::memory_order_relaxed);
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
}

bool Team::done() noexcept {
    for (int wait = 0; wait < awake; ++wait) {
        if (busy_.load(std::memory_order_acquire) == 0) return true;
        pause();
    }
    std::this_thread::yield();
    return false;
}

void Team::serve(int part) noexcept {
    for (unsigned known = 0;; ++known) {
        for (int wait = 0; round_.load(std::memory_order_acquire) == known && wait < awake; ++wait) pause();
        round_.wait(known, std::memory_order_acquire);
        if (ending_) return;
        call_(work_, part);
        busy_.fetch_sub(1, std::memory_order_release);
    }
}

void Team::meet() noexcept {
    const unsigned size = static_cast<unsigned>(size_),
                   before = arrived_.fetch_add(1, std::memory_order_acq_rel);
    const unsigned all = (before / size + 1) * size;
    if (before + 1 == all) {
        arrived_.notify_all();
        return;
    }
    for (int wait = 0;; ++wait) {
        const unsigned now = arrived_.load(std::memory_order_acquire);
        if (now >= all) return;
        if (wait < awake) pause();
        else arrived_.wait(now, std::memory_order_acquire);
    }
}

#endif

}  // namespace spook
