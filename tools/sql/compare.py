#!/usr/bin/env python3
"""Does SQL on a store answer what DuckDB answers on its Parquet export?

  compare.py TETDB_SQL TETDB STORE FOLDER [--times N]

TETDB needs the feature `parquet`; FOLDER takes the export, which is kept. Each query is asked both ways; rows are compared as they come, or
sorted where the query does not sort. Numbers may differ by 1e-9 of their size, because sums are taken in another order. With --times, each
is asked so often in turn, and the least time is printed. Exit code 0 when all agree, else 1.
"""

import argparse
import csv
import glob
import io
import math
import subprocess
import time

import duckdb

QUERIES = [
    "SELECT count(*) FROM tets",
    "SELECT count(*) FROM tets WHERE x < 0.5",
    "SELECT count(*) FROM tets WHERE quality > 1.5 AND region = 0",
    "SELECT region, count(*), max(quality), sum(volume) FROM tets GROUP BY region",
    "SELECT region, count(*), max(quality) FROM tets WHERE x < 0.5 GROUP BY region",
    "SELECT id, quality FROM tets ORDER BY quality DESC, id LIMIT 10",
    "SELECT id, x, y, z FROM tets WHERE x BETWEEN 0.4 AND 0.41 AND y < 0.1 ORDER BY id",
    "SELECT count(*) FROM tets WHERE NOT (x > 0.2 OR quality < 1.1)",
    "SELECT count(*) FROM tets WHERE region IN (0, 2) AND z >= 0.75",
    "SELECT count(*) FROM tets WHERE region NOT IN (0, 2)",
    "SELECT floor(quality * 10) AS bin, count(*) FROM tets GROUP BY 1 ORDER BY 1",
    "SELECT subdomain, avg(quality), min(volume), max(volume) FROM tets GROUP BY subdomain",
    "SELECT count(*) FROM tets WHERE x < y AND y < z",
    "SELECT min(x), max(x), min(y), max(y), min(z), max(z) FROM vertices",
    "SELECT tag, count(*), count(DISTINCT id), avg(h) FROM vertices GROUP BY tag",
    "SELECT count(*) FROM vertices WHERE x > 0 AND h < 0.1",
    "SELECT t.region, count(*), CAST(max(v.h) AS DOUBLE) FROM tets t JOIN (SELECT DISTINCT id, h, tag FROM vertices) v ON t.v0 = v.id WHERE v.tag = 1 GROUP BY t.region",
    "SELECT region, subdomain, count(*) FROM tets WHERE volume > 1e-6 GROUP BY region, subdomain HAVING count(*) > 10",
    "SELECT count(*) FROM (SELECT v0 FROM tets WHERE z < 0.1 UNION SELECT v1 FROM tets WHERE z < 0.1)",
    "SELECT id FROM tets WHERE quality > (SELECT avg(quality) * 1.5 FROM tets) ORDER BY id",
    "SELECT count(*) FROM tets WHERE id % 1000 = 7 AND x <> 0.5",
]


def value(text):
    try:
        return float(text)
    except ValueError:
        return text


def same(a, b):
    if isinstance(a, float) and isinstance(b, float):
        return a == b or math.isclose(a, b, rel_tol=1e-9) or (math.isnan(a) and math.isnan(b))
    return a == b


def rows(found, query):
    return found if "ORDER BY" in query else sorted(found, key=str)


def main():
    words = argparse.ArgumentParser()
    words.add_argument("sql")
    words.add_argument("tetdb")
    words.add_argument("store")
    words.add_argument("folder")
    words.add_argument("--times", type=int, default=1)
    words.add_argument("--threads", type=int, default=2)
    a = words.parse_args()
    name = f"{a.folder}/export"
    if not glob.glob(f"{name}_*.parquet"):
        subprocess.run([a.tetdb, "export", a.store, f"{name}.parquet"], check=True, capture_output=True)
    database = duckdb.connect(config={"threads": a.threads})
    for table, pattern in (("tets", "?????"), ("vertices", "?????_vertices")):
        database.sql(f"CREATE VIEW {table} AS SELECT * FROM read_parquet('{name}_{pattern}.parquet')")
    wrong = 0
    for query in QUERIES:
        seconds = [math.inf, math.inf]
        for _ in range(a.times):
            begin = time.perf_counter()
            done = subprocess.run([a.sql, a.store, query, "--csv", "--threads", str(a.threads)], capture_output=True, text=True)
            seconds[0] = min(seconds[0], time.perf_counter() - begin)
            begin = time.perf_counter()
            theirs = database.sql(query).fetchall()
            seconds[1] = min(seconds[1], time.perf_counter() - begin)
        if done.returncode:
            print(f"{query}: {done.stderr}")
            wrong += 1
            continue
        ours = [tuple(map(value, row)) for row in list(csv.reader(io.StringIO(done.stdout)))[1:]]
        theirs = [tuple(float(x) if isinstance(x, (int, float)) else x for x in row) for row in theirs]
        ours, theirs = rows(ours, query), rows(theirs, query)
        agrees = len(ours) == len(theirs) and all(all(map(same, x, y)) for x, y in zip(ours, theirs))
        wrong += not agrees
        print(f"{'same' if agrees else 'DIFFERS'}: {len(ours)} rows, store {seconds[0]:.3f} s, Parquet {seconds[1]:.3f} s: {query}")
        if not agrees:
            print(ours[:3], theirs[:3])
    raise SystemExit(wrong > 0)


main()
