"""What no command takes is one sentence, exit code 2, and nothing written."""

import pathlib
import re
import shlex

import pytest
from command import Call
from documents import ROOT

MINE = "orthosis.muscle.dorsiflexor"
WALK = "walk walk-dropfoot-afo"
BANDS = "run walk-dropfoot-afo --uncertainty"
ASSESSED = "credibility --question q --context c --consequence low"
SIZE = "size pressure seated --limit 'peak_dorsiflexion_angle >= 2 deg'"
LEG = f"attach {ROOT}/models/legs/adult_75kg/leg.xml"
MOT = "gait import x.mot --walker healthy --out x.csv"
REFUSED = [
    # keys and values of a description
    ("run --set 'supply.presure=3 bar'", "did you mean 'pressure'"),
    ("run --set 'supply.pressure=3 kg'", "does not convert"),
    ("run --set 'supply.pressure=3 barr'", "unknown unit"),
    ("run --set supply.pressure=3", 'write it like "4 bar"'),
    ("run --set 'supply.pressure=-3 bar'", "more than 0 bar"),
    ("run --set 'supply.pressure=-0.5 bar'", "more than 0 bar"),
    ("run --set 'supply.pressure=nan bar'", "not finite"),
    (f"run --set '{MINE}.type.end_length=22 cm'", "no braid is left"),
    (f"run --set '{MINE}.link_length=5 cm' --set 'orthosis.anchor={{}}'", "too taut"),  # nothing gives
    ("""run --set 'timer.dorsiflexor.inlet=[["0 s", "9 s"]]'""", "not within the period"),
    ("""run --set 'timer.dorsiflexor.inlet=[["3 s", "2 s"]]'""", "not within the period"),
    ("run --set 'duration=0 s'", "more than 0 s"),
    ("run --set 'duration=0.1 ms'", "shorter than one time step"),
    ("""run --set 'timer.dorsiflexr.inlet=[["0 s", "1 s"]]'""", "did you mean 'dorsiflexor'"),
    (f"run --set {MINE}.type.law=tondu_lopez_200", "did you mean 'tondu_lopez_2000'"),
    (f"run --set {MINE}.type=s1_21mm", "did you mean 's1_215mm'"),
    ("run --set timer.dorsiflexor.inlet=4", 'is not a list; allowed: [["0 s", "4 s"]]'),
    ("""run --set 'timer.dorsiflexor.inlet=[["0 s", "4 s", "5 s"]]'""", "too many items"),
    (f"run --set '{MINE}.origin.from_joint=6 cm'", "is not a list"),
    (f"run --set {MINE}.count=2.5", "whole number"),
    ("run --set callback=nativ", "'native' or 'python'"),
    ("run --set supply.pressure", "KEY=VALUE"),
    ("run --set 'supply=3 bar'", "not a table"),
    ("run --set 'duration.x=3 s'", "not a table"),
    ("run seted", "did you mean 'seated'"),
    # bands
    (f"{BANDS} -5", "--uncertainty = -5"),
    (f"{BANDS} 19", "20 to 100000"),
    ("run seated --uncertainty 200", "nobody walks"),
    (f"{BANDS} 20 --spreads usal", "did you mean 'usual'"),
    (f"{BANDS} 20 --spreads .", "--spreads"),
    ("run walk-dropfoot-afo --spreads usal", "--spreads = 'usal': goes with --uncertainty"),
    # an assessment
    (f"{ASSESSED} seated --influence low", "does not walk"),
    (f"{ASSESSED} walk-dropfoot --influence lo", "--influence = 'lo': is not a valid choice"),
    (f"{ASSESSED} walk-dropfoot --influence low --metric toe_clearence", "did you mean 'toe_clearance'"),
    (f"{ASSESSED} walk-dropfoot --influence low --context ' '", "--context: is empty"),
    (f"{ASSESSED} walk-dropfoot --influence low --draws 5", "20 to 100000"),
    # options that stand for the library's arguments
    (f"{MOT} --mass '3 bar'", "afo-sim: --mass = '3 bar'"),
    (f"{MOT} --ankle-zero up", "afo-sim: --ankle-zero = 'up'"),
    ("new muscle mine --leg adult_75kg", "afo-sim: --leg = 'adult_75kg': is not an option of a new muscle"),
    ("new muscle mine --like nowhere", "afo-sim: --like = 'nowhere': there is no such muscle"),
    ("new sweep mine --like nowhere", "afo-sim: --like = 'nowhere': there is no such sweep"),
    ("new valve m/n", "afo-sim: NAME = 'm/n'"),
    ("compare arm --laws kerscher", "afo-sim: --laws = 'kerscher': is not a law that all muscles"),
    ("torque-map --angle '-90 deg' '90 deg' '10 deg'", "--angle = '-90 to 90 deg': goes beyond the ankle's"),
    ("torque-map --angle '5 deg' '-5 deg' '1 deg'", "--angle"),
    ("torque-map --angle 5 6 1", "--angle"),
    ("torque-map --pressure '-1 bar'", "--pressure"),
    ("torque-map --pressure '50 bar'", "--pressure"),
    ("torque-map walk-healthy", "has no chamber: there is no torque to map"),
    (
        "torque-map knee --walk walk-dropfoot-afo",
        "--walk = 'walk-dropfoot-afo': is not a walk on the same leg",
    ),
    ("torque-map seated --walk seated", "--walk"),
    ("torque-map seated --walk walk-dropfoot-af", "--walk = 'walk-dropfoot-af': there is no such scenario"),
    ("torque-map --uncertainty 5", "--uncertainty = 5"),
    ("torque-map --uncertainty -5", "--uncertainty = -5"),
    ("torque-map seated --uncertainty 20", "nobody walks"),
    # files that are not there, or something else
    (f"view {ROOT}/README.md --screenshot x.png", "README.md"),
    (f"view {ROOT}/models {ROOT}/README.md --screenshot x.png", "README.md"),
    ("view nowhere", "nowhere"),
    ("view . --at '1 s'", "--at"),
    ("view . --screenshot x.jpg", "--screenshot"),
    ("view . --colour red", "--colour"),
    ("view . --rate '0 Hz'", "--rate"),
    ("list muscle", "muscle"),
    ("check nowhere.toml", "nowhere.toml"),
    (f"check {ROOT}/README.md", "README.md"),
    ("check-run nowhere", "nowhere"),
    ("figure nowhere", "nowhere"),
    ("video nowhere x.mp4", "nowhere"),
    ("video . x.avi", "OUT"),
    # size and both
    ("size pump seated", "pressure, valve, tube, supply, muscle"),
    ("size pressure seatd", "did you mean 'seated'"),
    ("size pressure seated", "--limit: is needed"),
    (f"{SIZE} --at 3", "--at"),
    ("size tube walk-dropfoot-afo --length '-1 m'", "--length"),
    ("size valve walk-dropfoot-afo --chamber calf", "--chamber"),
    ("size muscle walk-dropfoot-afo --count one", "--count"),
    ("size valve walk-dropfoot-afo --hours 2", "--hours"),
    ("both seated --apart 0.5", "--apart"),
    ("both seated --left walk-dropfoot-afo", "sits"),
    ("both seated --left-set duration", "--left-set"),
    ("both seated --left seatd", "seated"),
    # a walker that responds
    (f"{WALK} --strength tibialis=3", "--strength tibialis = 3: is out of range; allowed: 0 to 2"),
    (f"{WALK} --strength tibialis=-0.1", "allowed: 0 to 2"),
    (f"{WALK} --strength tibialis=weak", "allowed: 0 to 2"),
    (f"{WALK} --strength tibealis=0", "did you mean 'tibialis'"),
    (f"{WALK} --strength tibialis", "is not KEY=VALUE"),
    ("walk seated", "nobody walks in it"),
    ("walk walk-dropfoot-af", "did you mean 'walk-dropfoot-afo'"),
    (f"{WALK} --gait naturel", "did you mean 'natural'"),
    (f"{WALK} --adapted naturel", "did you mean 'natural'"),
    ("walk walk-dropfoot --adapted-device natural", "--adapted-device = 'natural': no device is worn"),
    (f"{WALK} --vary 'supply.presure=1 bar'", "did you mean 'pressure'"),
    (f"{WALK} --vary supply.pressure", "is not KEY=V1,V2,…"),
    (f"{WALK} --vary 'supply.pressure=2 bar,-3 bar'", "supply.pressure"),
    (f"{WALK} --vary strength.tibealis=1,0", "--vary strength.tibealis = 'tibealis': is not a muscle"),
    (f"{WALK} --vary strength.tibealis=1,0", "did you mean 'tibialis'"),
    (
        f"{WALK} --vary strength.tibialis=1,2.5",
        "--vary strength.tibialis = 2.5: is out of range; allowed: 0 to 2",
    ),
    (f"{WALK} --vary strength.tibialis=1,weak", "allowed: 0 to 2"),
    (f"{WALK} --vary strength.tibialis=1,true", "allowed: 0 to 2"),
    (f"{WALK} --vary strength=1,0", "is not a muscle of the walker"),
    (f"{WALK} --vary strenght.tibialis=1,0", "is an unknown key"),
    (f"{WALK} --subset arms", "--subset"),
    (f"{WALK} --generations -1", "--generations"),
    (f"{WALK} --starts -1", "--starts"),
    (f"{WALK} --seed -1", "--seed"),
    (f"{WALK} --duration '1 s'", "out of range"),
    (f"{WALK} --duration 'nan s'", "--duration"),
    (f"{WALK} --push '9 kg'", "--push"),
    (f"{WALK} --set 'timestep=3 ms'", "a whole part of 10 ms"),
    (f"{WALK} --set patient.dorsiflexor_strength=7", "dorsiflexor_strength"),
    # electronics
    ("electronics walk-healthy", "no valve to switch"),
    ("electronics seated --read no/such.csv", "there is no such file"),
    ("electronics seated --read a.csv --out b", "one of the two"),
    ("electronics seated --read a.csv --within '3 bar'", "--within"),
    ("electronics seated --firmware no/such.c", "neither a C file nor the folder of an export"),
    # orthoses on other legs
    ("attach nowhere.xml --orthosis s1", "there is no such file"),
    (f"attach {ROOT} --orthosis s1", "is a folder"),
    (f"{LEG} --orthosis s2", "did you mean 's1'"),
    (f"{LEG} --orthosis s1 --side rihgt", "did you mean 'right'"),
    (f"{LEG} --orthosis s1 --shank shnak", "did you mean 'shank'"),
    (f"{LEG} --orthosis s1 --joint 3", "--joint = '3': there is no such joint"),
    (f"{LEG} --orthosis s1 --joint ''", "--joint = '': there is no such joint"),
    (f"{LEG} --orthosis s1 --supply much", "--supply"),
    (f"{LEG} --orthosis s1 --zero 3", "--zero"),
    (f"{LEG} --orthosis s1 --timestep '50 ms'", "at most"),
    (f"{LEG} --orthosis s1 --prefix 'x y'", "--prefix"),
    (f"{LEG} --orthosis s1 --out leg.toml", "NAME.xml"),
    ("refit s1 --to adult_75kg", "--out"),
    ("refit s1 --out mine", "--to"),
    ("refit s1 --to adult_75kg --foot-length '22 cm' --out mine", "--to"),
    ("refit s1 --shank-length 35 --out mine", "--shank-length"),
    ("refit s1 --shank-length '3 mm' --out mine", "--shank-length"),
    ("refit s1 --foot-length 'nan m' --out mine", "--foot-length"),
    ("refit s2 --to adult_75kg --out mine", "s1"),
    ("refit s1 --to adult_75 --out mine", "adult_75kg"),
    ("refit s1 --shank-length '20 cm' --foot-length '12 cm' --out mine", "a shorter muscle"),
    ("leg export seated", "--to"),
    ("leg export seated --to a.stl", ".urdf"),
    ("leg export seatd --to b.urdf", "did you mean 'seated'"),
    ("leg export seated --orthosis s11 --to b.urdf", "did you mean 's1'"),
    # gait
    ("gait show gatk_stride3", "did you mean 'gatk_stride"),
    ("gait show norm_adult", "is a norm to compare with"),
    ("gait show gatk_stride1 --out x.gif", "x.gif"),
    ("gait import not_there.c3d --out x.csv --walker me", "healthy, patient"),
]


@pytest.mark.parametrize(("line", "says"), REFUSED, ids=[line for line, _ in REFUSED])
def test_it_is_one_sentence_and_nothing_is_written(
    line: str, says: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line)
    code, printed, complaint = call(*words)
    assert code == 2 and says in complaint, complaint
    if words[:2] == ["run", "--set"]:  # the key is named
        assert re.split(r"[.=]", words[2])[0] in complaint
    assert complaint.startswith("afo-sim: ") and complaint.strip().count("\n") == 0
    assert "Traceback" not in printed + complaint
    assert not list(tmp_path.iterdir())
