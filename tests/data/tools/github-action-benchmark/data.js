window.BENCHMARK_DATA = {
  "lastUpdate": 1761990000000,
  "repoUrl": "https://example.org/gravel",
  "entries": {
    "Gravel": [
      {
        "commit": {
          "author": {
            "name": "A. Author",
            "username": "author"
          },
          "committer": {
            "name": "A. Author"
          },
          "distinct": true,
          "id": "1111111111111111111111111111111111111111",
          "message": "solver: reuse the factor",
          "timestamp": "2026-11-01T10:00:00+01:00",
          "tree_id": "ffffffffffffffffffffffffffffffffffffffff",
          "url": "https://example.org/gravel/commit/1111111111111111111111111111111111111111"
        },
        "date": 1761990000000,
        "tool": "cargo",
        "benches": [
          {
            "name": "heap",
            "value": 10400,
            "range": "\u00b1 208",
            "unit": "ns/iter"
          },
          {
            "name": "rope",
            "value": 500,
            "range": "\u00b1 10",
            "unit": "ns/iter"
          },
          {
            "name": "door",
            "value": 70,
            "range": "\u00b1 1",
            "unit": "ns/iter"
          }
        ]
      },
      {
        "commit": {
          "author": {
            "name": "A. Author",
            "username": "author"
          },
          "committer": {
            "name": "A. Author"
          },
          "distinct": true,
          "id": "2222222222222222222222222222222222222222",
          "message": "solver: reuse the factor",
          "timestamp": "2026-11-02T10:00:00+01:00",
          "tree_id": "ffffffffffffffffffffffffffffffffffffffff",
          "url": "https://example.org/gravel/commit/2222222222222222222222222222222222222222"
        },
        "date": 1762076400000,
        "tool": "cargo",
        "benches": [
          {
            "name": "heap",
            "value": 10300,
            "range": "\u00b1 206",
            "unit": "ns/iter"
          },
          {
            "name": "rope",
            "value": 510,
            "range": "\u00b1 10",
            "unit": "ns/iter"
          },
          {
            "name": "door",
            "value": 71,
            "range": "\u00b1 1",
            "unit": "ns/iter"
          }
        ]
      },
      {
        "commit": {
          "author": {
            "name": "A. Author",
            "username": "author"
          },
          "committer": {
            "name": "A. Author"
          },
          "distinct": true,
          "id": "3333333333333333333333333333333333333333",
          "message": "solver: reuse the factor",
          "timestamp": "2026-11-03T10:00:00+01:00",
          "tree_id": "ffffffffffffffffffffffffffffffffffffffff",
          "url": "https://example.org/gravel/commit/3333333333333333333333333333333333333333"
        },
        "date": 1762162800000,
        "tool": "cargo",
        "benches": [
          {
            "name": "heap",
            "value": 10350,
            "range": "\u00b1 207",
            "unit": "ns/iter"
          },
          {
            "name": "door",
            "value": 70,
            "range": "\u00b1 1",
            "unit": "ns/iter"
          }
        ]
      }
    ]
  }
}