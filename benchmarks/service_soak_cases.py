"""Schemathesis on a service that runs: ``python service_soak_cases.py PORT TOKEN SECONDS SEED``.

Goes through the operations of its OpenAPI description again and again, with what fits it and what does not,
until the time is over. Prints one JSON object.
"""

from __future__ import annotations

import json
import sys
import time
import urllib.request
from collections import Counter

import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings

EXAMPLES = 10
"""Cases of an operation in one round."""


def main() -> None:
    """Send and print."""
    port, token, seconds, first = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
    url = f"http://127.0.0.1:{port}"
    with urllib.request.urlopen(f"{url}/openapi.json", timeout=300) as answer:
        schema = schemathesis.openapi.from_dict(json.load(answer))
    codes: Counter[str] = Counter()
    until, rounds = time.monotonic() + seconds, 0

    def send(case: schemathesis.Case) -> None:  # type: ignore[type-arg]
        # A live stream lasts as long as the run does.
        if time.monotonic() > until or case.operation.path.endswith("/live"):
            return
        try:
            answer = case.call(base_url=url, headers={"Authorization": f"Bearer {token}"}, timeout=120)
            status = str(answer.status_code)
        except OSError as error:
            status = type(error).__name__
        codes[f"{case.operation.method.upper()} {case.operation.path} {status}"] += 1

    while time.monotonic() < until:
        rounds += 1
        for number, operation in enumerate(found.ok() for found in schema.get_all_operations()):
            settled = settings(
                max_examples=EXAMPLES,
                deadline=None,
                database=None,
                phases=(Phase.generate,),
                suppress_health_check=list(HealthCheck),
            )
            seed(1000 * first + 100 * rounds + number)(settled(given(operation.as_strategy())(send)))()
    broken = {what: count for what, count in codes.items() if what.rpartition(" ")[2][0] not in "1234"}
    print(json.dumps({"cases": sum(codes.values()), "rounds": rounds, "codes": codes, "broken": broken}))


if __name__ == "__main__":
    main()
