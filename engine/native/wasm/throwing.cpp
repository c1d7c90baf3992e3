// WebAssembly has no exceptions here: what throws elsewhere (a scene no page can say) stops the module. It has one
// thread, too, which lives as long as the page: nothing of its own is ever taken down.
#include <cstddef>
#include <cstdlib>

extern "C" {
void* __cxa_allocate_exception(std::size_t) noexcept { std::abort(); }
void __cxa_throw(void*, void*, void (*)(void*)) { std::abort(); }
int __cxa_thread_atexit(void (*)(void*), void*, void*) noexcept { return 0; }
}
