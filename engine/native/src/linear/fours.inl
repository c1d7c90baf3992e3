// Numbers, and vectors of four where SPOOK_FOURS says that they are at hand. Included within a namespace per instruction
// set.

#define SPOOK_FOURS_INLINE inline __attribute__((always_inline))

SPOOK_FOURS_INLINE bool any(bool mask) { return mask; }
SPOOK_FOURS_INLINE double magnitude(double x) { return std::abs(x); }
SPOOK_FOURS_INLINE double root_of(double x) { return std::sqrt(x); }

#ifdef SPOOK_FOURS
typedef double Four __attribute__((vector_size(32)));
typedef double FourInMemory __attribute__((vector_size(32), aligned(8), may_alias));
typedef decltype(Four{} < Four{}) FourBits;

SPOOK_FOURS_INLINE bool any(const FourBits& mask) { return __builtin_ia32_movmskpd256((Four)mask) != 0; }
SPOOK_FOURS_INLINE Four magnitude(const Four& x) { return (Four)((FourBits)x & 0x7fffffffffffffffL); }
SPOOK_FOURS_INLINE Four root_of(const Four& x) { return __builtin_ia32_sqrtpd256(x); }
#endif

#undef SPOOK_FOURS_INLINE
