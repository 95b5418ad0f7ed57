"""From measured rows over their causes to a rewritten program, cell by cell as in a notebook.

Run it as it is, or open it where cells marked by ``# %%`` are shown as a notebook: each result shows its page there.
"""

# %% What was measured, on which arm.
import sys
from pathlib import Path

import numpy as np

import truegrind as tg

ROOT = Path(__file__).resolve().parents[2]
arm = tg.Robot("abb-irb-120")
rows = tg.Dataset.from_csv(ROOT / "tests" / "data" / "irb120-cable.csv")
print(rows)

# %% The arm that gives these readings, without and with the causes of what geometry does not explain.
fitted = tg.identify(rows, arm)
print(f"held-out RMSE: data sheet {fitted.held_out_rmse_before_mm:.3f} mm, geometry {fitted.held_out_rmse_mm:.3f} mm")
found = tg.diagnose(rows, arm, progress=lambda step: print("…", step, file=sys.stderr))
for finding in found.findings:
    print(f"{finding['confidence']:>10}  {finding['effect']}")
print(f"with its causes {found.held_out_rmse_mm:.3f} mm; verdict: {found.verdict}")

# %% Where the real arm stands, against where the controller takes it to be: arrays in, arrays out.
random = np.random.default_rng(0)
q_deg = random.uniform(0.5 * arm.min_deg, 0.5 * arm.max_deg, (100_000, 6))
off_mm = np.linalg.norm(found.model.forward(q_deg).position_mm - arm.forward(q_deg).position_mm, axis=1)
print(f"{len(q_deg)} poses: {off_mm.mean():.2f} mm off on average, {off_mm.max():.2f} mm at most")

# %% A program that this arm runs as it was meant.
PROGRAM = """MODULE Grind
  PERS tooldata tDisc := [TRUE,[[0,0,85],[1,0,0,0]],[0.8,[0,0,40],[1,0,0,0],0,0,0]];
  CONST robtarget p10 := [[380,-60,250],[0,0,1,0],[-1,-1,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20 := [[380,60,250],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL p10,v50,fine,tDisc;
    MoveL p20,v50,fine,tDisc;
  ENDPROC
ENDMODULE
"""
done = tg.compensate({"grind.mod": PROGRAM}, found.model, allow_doubtful=True)
print(done)
print(done.programs["grind.mod"].decode())

# %% How far it would have been off.
before = tg.deviation({"grind.mod": PROGRAM}, found.model)
print(before)
assert done.changed and done.counts["changed"] + done.counts["flagged"] == 2, done.counts
