"""Every timing claim of the project, as tests with limits: `make bench` asks them and keeps what came of it in a history."""

from bench import (
    bench_growth,
    bench_heaps,
    bench_import,
    bench_months,
    bench_particles,
    bench_publish,
    bench_replay,
    bench_rigid,
    bench_scenes,
    bench_smooth,
    bench_storage,
)

QUICK = {
    **bench_particles.TESTS,
    **bench_rigid.TESTS,
    **bench_smooth.TESTS,
    **bench_months.TESTS,
    **bench_publish.TESTS,
    **bench_import.TESTS,
    **bench_storage.TESTS,
}
CATALOGUE = {**QUICK, **bench_growth.TESTS, **bench_heaps.TESTS, **bench_replay.TESTS, **bench_scenes.TESTS}
