"""Evaluations of the policies in models/, for their cards and for figures."""
import json
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
EVALUATIONS, DATE = ROOT / "bench/results/agent_29_november.json", "29 November 2026"


def metrics_of(policy, density):
    """Returns the metrics of models/POLICY.safetensors at a density with independent lights, a row of `pictura evaluate --json`."""
    policies = json.loads(EVALUATIONS.read_text())["policies"]
    (reports,) = (reports for name, reports in policies.items() if name.startswith(f"models/{policy}.safetensors"))
    return reports[density]["rows"][0]
