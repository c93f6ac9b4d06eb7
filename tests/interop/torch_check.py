"""Does in PyTorch the updates that tests/it/torch.rs did, and compares every weight.

The agreement is measured against the largest weight of each layer, because single weights may be
nearly 0; what a layer learned (last minus first) is compared too, so that no agreement comes from
weights that hardly moved. PyTorch computes in double precision, so that only our rounding shows: in single
precision it may choose another row where two are nearly as good, and then goes another way.
"""

import json
import sys

import torch
from torch import nn

RELATIVE_MAX = 1e-4


class QNetwork(nn.Module):
    def __init__(self, layers, dueling):
        super().__init__()
        widths = layers[:-1] + [layers[-1] + (1 if dueling else 0)]
        self.linear = nn.ModuleList(nn.Linear(a, b) for a, b in zip(widths, widths[1:]))
        self.dueling = dueling

    def forward(self, x):
        for linear in self.linear[:-1]:
            x = torch.relu(linear(x))
        x = self.linear[-1](x)
        if self.dueling:
            advantages, value = x[:, :-1], x[:, -1:]
            x = value + advantages - advantages.mean(dim=1, keepdim=True)
        return x

    def load(self, numbers):
        numbers = torch.tensor(numbers, dtype=torch.float64)
        at = 0
        with torch.no_grad():
            for linear in self.linear:
                outputs, inputs = linear.weight.shape
                linear.weight.copy_(numbers[at : at + inputs * outputs].reshape(inputs, outputs).T)
                at += inputs * outputs
                linear.bias.copy_(numbers[at : at + outputs])
                at += outputs
        assert at == len(numbers)


def column(transitions, name, dtype=torch.float64):
    return torch.tensor([one[name] for one in transitions], dtype=dtype)


def check(case):
    online, target, theirs, first = (QNetwork(case["layers"], case["dueling"]) for _ in range(4))
    for network, numbers in ((online, "first"), (target, "first"), (first, "first"), (theirs, "last")):
        network.load(case[numbers])
    adam = torch.optim.Adam(online.parameters(), lr=case["learning_rate"])
    transitions, length = case["transitions"], case["batch_len"]
    weights = torch.tensor([1.0 / (1.0 + at % 4) for at in range(length)])
    loss_worst = 0.0
    for update, expected in enumerate(case["losses"]):
        batch = [transitions[(update * 37 + at * 11) % len(transitions)] for at in range(length)]
        with torch.no_grad():
            following, legal = column(batch, "next_inputs"), column(batch, "next_legal", torch.bool)
            values = target(following)
            choosing = (online(following) if case["double"] else values).masked_fill(~legal, -torch.inf)
            best = values.gather(1, choosing.argmax(dim=1, keepdim=True)).squeeze(1)
            goals = column(batch, "reward") + column(batch, "discount") * best
        rows = column(batch, "row", torch.int64).unsqueeze(1)
        found = online(column(batch, "inputs")).gather(1, rows).squeeze(1)
        cost = nn.functional.huber_loss if case["huber"] else nn.functional.mse_loss
        loss = (weights * cost(found, goals, reduction="none")).mean()
        adam.zero_grad()
        loss.backward()
        if case["norm_max"] is not None:
            nn.utils.clip_grad_norm_(online.parameters(), case["norm_max"])
        adam.step()
        loss_worst = max(loss_worst, abs(loss.item() - expected) / abs(expected))
        if (update + 1) % case["target_period"] == 0:
            target.load_state_dict(online.state_dict())
    worst, moved_worst = 0.0, 0.0
    for ours, other, begin in zip(online.parameters(), theirs.parameters(), first.parameters()):
        gap = (ours - other).abs().max().item()
        worst = max(worst, gap / other.abs().max().item())
        moved_worst = max(moved_worst, gap / (other - begin).abs().max().item())
    print(f"{case['preset']}: weights differ by {worst:.1e}, what they learned by {moved_worst:.1e}, losses by {loss_worst:.1e}")
    return worst <= RELATIVE_MAX


torch.set_default_dtype(torch.float64)
def main():
    torch.set_num_threads(1)
    cases = json.load(open(sys.argv[1]))
    print(f"PyTorch {torch.__version__}, {len(cases[0]['losses'])} updates each")
    if not all([check(case) for case in cases]):
        sys.exit(f"the weights differ by more than {RELATIVE_MAX}")


main()
