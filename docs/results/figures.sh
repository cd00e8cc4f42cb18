#!/usr/bin/env bash
# The runs of the figures of these pages, and the `tandem plot` commands that draw them. `docs/results/make` calls it.
#
#     docs/results/figures.sh [PAGE]...     # all pages by default: an hour of CPU time
#
# Runs go to runs/ and figures to figures/ of the present directory; a run that is there already is not made again.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
ln -sfn "$here/../../scenes" scenes
mkdir -p runs figures

run() { # NAME SCENE [OPTION]...: a scene of scenes/, or a file; that checks fail (1) is a result
    local scene=$2
    [ -e "$scene" ] || scene=scenes/$2.toml
    [ -e "runs/$1/summary.json" ] || { rm -rf "runs/$1"; tandem run "$scene" --in-process --out "runs/$1" "${@:3}" || [ $? = 1 ]; }
}
study() { # NAME SCENE [OPTION]...
    [ -e "runs/$1/study.csv" ] || { rm -rf "runs/$1"; tandem study "scenes/$2.toml" --in-process --out "runs/$1" "${@:3}"; }
}
figure() { # FILE [OPTION]...: of `tandem plot`
    tandem plot --out "figures/$1" "${@:2}"
}

jiang2020() {
    run collision_soft jiang2020/collision_soft
    run collision_hard jiang2020/collision_hard
    figure jiang_07_collision.svg soft=runs/collision_soft hard=runs/collision_hard --y "rigid disc=v_target^2" --y "elastic disc=v_disc^2" \
        --expected "paper, hard: 1.992^2=1.992^2" --expected "paper, soft: 1.92^2=1.92^2" --xlabel "time [s]" --ylabel "v^2 [m^2/s^2]" \
        --title "Figure 7: squared speeds of two discs that collide"

    figure jiang_06_energies.svg soft=runs/collision_soft hard=runs/collision_hard --y kinetic --y elastic --y contact --xlabel "time [s]" \
        --ylabel "energy [J/m]" --title "Figure 6: energies while the discs collide"

    run drop_soft jiang2020/drop_soft --set output.frames=0.001
    figure jiang_08_drop.svg runs/drop_soft --frames 0,0.2,0.204,0.206,0.21,0.244 --columns 3 --clim 0,2.5 \
        --title "Figure 8: the soft disc falls and bounces"

    run drop_hard jiang2020/drop_hard
    figure jiang_09_drop.svg soft=runs/drop_soft hard=runs/drop_hard --y "v_disc^2" --expected "2 g h=2*9.81*0.204" \
        --expected "paper, hard: 98.95 %=0.9895*2*9.81*0.204" --expected "paper, soft: 93.05 %=0.9305*2*9.81*0.204" --ylabel "v^2 [m^2/s^2]" \
        --title "Figure 9: squared speed of a disc that falls and bounces"

    figure jiang_10_rebound.svg soft=runs/drop_soft hard=runs/drop_hard --y kinetic --y elastic --xlim 0.19,0.23 --ylabel "energy [J/m]" \
        --title "Figures 8 and 10: energies during the rebound"

    run normal_force jiang2020/normal_force --variant cell_3_5mm
    run normal_force_4 jiang2020/normal_force --variant cell_4mm
    run normal_force_4_5 jiang2020/normal_force --variant cell_4_5mm
    run normal_force_5 jiang2020/normal_force --variant cell_5mm
    figure jiang_12_normal_force.svg "3.5 mm=runs/normal_force" "4 mm=runs/normal_force_4" "4.5 mm=runs/normal_force_4_5" "5 mm=runs/normal_force_5" \
        --y force --expected "weight=25" --title "Figure 12: force on the floor, four grids"

    run friction_force jiang2020/friction_force
    figure jiang_14_friction_force.svg runs/friction_force --y friction --expected "mu m g=-7.5" \
        --title "Figure 14: friction of a sliding block"

    run silo_4 jiang2020/silo --variant d4cm --set time.end=1.0 --set output.frames=0.1
    figure jiang_15_silo.svg runs/silo_4 --frames 0,0.3,0.5,1 --colour "speed^2 [m^2/s^2]=speed^2" \
        --title "Figure 15: flow out of the silo, 4 cm"

    study silo jiang2020/silo \
        --vary variant=d2cm,d3cm,d4cm,d5cm,d6cm --vary mpm.points.0.spacing.distance=1.16667e-3,1.1e-3,1.0435e-3 \
        --value "mass flow over Beverloo's law" --resolution variant
    sed "1s/mass flow over Beverloo's law/flow/" runs/silo/study.csv > runs/silo/flow.csv
    figure jiang_16_silo.svg runs/silo/flow.csv --x "resolution+2" --y "flow*0.58*1500*sqrt(9.81)*(0.01*(resolution+2)-2.2e-3)^1.5" \
        --by mpm.points.0.spacing.distance --dots --expected "Beverloo, 2D=0.58*1500*sqrt(9.81)*(0.01*x-2.2e-3)^1.5" \
        --expected "discs, 1.67 times that=1.67*0.58*1500*sqrt(9.81)*(0.01*x-2.2e-3)^1.5" --xlabel "neck [cm]" \
        --ylabel "mass flow [kg/(m s)]" --title "Figure 16: mass flow out of the silo"

    run blocks jiang2020/blocks --set output.frames=0.05
    figure jiang_20_snapshots.svg runs/blocks --frames 0.1,0.25,0.3,0.35,0.4,0.8 --xlim 0,0.5 --ylim -0.01,0.21 --clim 0,2 \
        --title "Figure 20: sand hits the blocks"

    figure jiang_21_blocks.svg runs/blocks --y "block 2=turned_2" --y "block 1=turned_1" --expected "90 degrees at 0.40 s=90" --ylabel "turned [degree]" \
        --title "Figure 21: blocks hit by sand"

    figure jiang_20_blocks.svg runs/blocks --y "front of the sand=100*front" --y "block 2=100*left_edge_2" --y "block 1=100*left_edge_1" \
        --expected "block 2 at rest=34.6" --expected "block 1 at rest=40.1" --ylabel "left edge, front [cm]" \
        --title "Figure 20: where the blocks and the front are"

    no_gate() { run "$1" jiang2020/blocks --variant no_gate --set time.end=0.45 --set time.min_step=1e-8 "${@:2}"; }
    no_gate flip --set mpm.transfer=flip --set mpm.leaving=remove
    no_gate apic
    no_gate apic5 --set time.max_step=5e-6
    no_gate apic2 --set time.max_step=2e-6
    figure jiang_20_front.svg "FLIP, no gate=runs/flip" "APIC, composed step, no gate=runs/apic" "APIC, 5 us, no gate=runs/apic5" \
        "APIC, 2 us, no gate=runs/apic2" "APIC, composed step, gate at 2 m/s=runs/blocks" --y "100*front" --expected "blocks=30" --xlim ,0.27 \
        --ylabel "front of the sand [cm]" --title "What decides when the sand arrives"

    run granular_matrix jiang2020/granular_matrix --set output.frames=0.02
    figure jiang_22_granular_matrix.svg runs/granular_matrix --frames 0,0.22 --xlim -0.02,0.63 --ylim -0.02,0.63 --colour "pressure [kPa]=pressure/1000" \
        --clim 0,300 --title "Figure 22: grains with fines, 35 %"

    run granular_matrix_low jiang2020/granular_matrix --variant fines_low
    run granular_matrix_high jiang2020/granular_matrix --variant fines_high
    figure jiang_23_granular_matrix.svg "26 %=runs/granular_matrix_low" "35 %=runs/granular_matrix" "42 %=runs/granular_matrix_high" --x "100*settlement" \
        --y work_of_the_bar/10 --slope 0.5 --xlabel "settlement [cm]" --ylabel "force on the bar [kN/m]" \
        --title "Figure 23: compression of grains with fines"

    python3 scenes/jiang2020/granular_matrix.py --cell 0.0035 --spacing 0.002 --container-stiffness 6e7 > full.toml
    for fines in low middle high; do
        run full_$fines full.toml $([ $fines = middle ] || echo --variant fines_$fines) --set mpm.material.0.model.drucker_prager.separates=true \
            --set "mpm.material.0.model.drucker_prager.critical_state={ volume = 1.05 }"
    done
    figure jiang_23_full.svg "25.7 %=runs/full_low" "35.7 %=runs/full_middle" "44.3 %=runs/full_high" --x "100*settlement" \
        --y work_of_the_bar/10 --slope 0.5 --xlabel "settlement [cm]" --ylabel "force on the bar [kN/m]" \
        --title "Figure 23 at the paper's cell, 3.5 mm"
}

singer2022() {
    run beam_single singer2022/beam_single
    run beam_multiple singer2022/beam_multiple
    mkdir -p runs/theory && python3 "$here/beam_reference.py" --dt 2e-7 --curves runs/theory
    for b in single multiple; do
      figure singer_beam_$b.svg tandem=runs/beam_$b elasticity=runs/theory/beam_${b}_plane.csv \
        timoshenko=runs/theory/beam_${b}_timoshenko.csv euler=runs/theory/beam_${b}_euler.csv \
        --y force --xlim 0,$([ $b = single ] && echo 2e-4 || echo 3.5e-3) --xlabel "time [s]" \
        --ylabel "force on the ball [N]"
    done

    run blocks_clusters singer2022/blocks_clusters --set output.frames=0.01
    figure singer_10_snapshots.svg runs/blocks_clusters --frames 0.25,0.3,0.36,0.38,0.4,0.45 --columns 3 --xlim 0.2,0.5 --ylim -0.01,0.11 --clim 0,2 \
        --title "Figure 10: sand hits blocks of discs"

    figure singer_11_blocks.svg runs/blocks_clusters --y "block 2=turned_2" --y "block 1=turned_1" --expected "block 2 at 0.40 s, 90 degrees=90" \
        --expected "block 1 at 0.45 s, 180 degrees=180" --xlim 0.24,0.6 --ylabel "turned [degree]" \
        --title "Figure 11: angles of the blocks"
}

chen2023() {
    run slide_slope chen2023/slide_slope
    figure chen_14_slide_slope.svg runs/slide_slope --y "speed [m/s]=v" --y "way [m]=way" --expected "g (sin - mu cos) t=3.5355*x" \
        --expected "half of its square=3.5355*x^2/2" --ylabel "speed [m/s], way [m]" \
        --title "Figure 14: a block slides down 45 degrees"

    run topple_20 chen2023/topple
    run topple_18 chen2023/topple --variant slope_18
    run topple_16 chen2023/topple --variant slope_16
    run topple_sudden chen2023/topple --variant sudden
    figure chen_12_topple.svg "16 degrees=runs/topple_16" "18 degrees=runs/topple_18" "20 degrees=runs/topple_20" \
        "16 degrees, put on the slope at once=runs/topple_sudden" "pendulum, 16 degrees=scenes/chen2023/topple_16.csv" \
        "pendulum, 18 degrees=scenes/chen2023/topple_18.csv" "pendulum, 20 degrees=scenes/chen2023/topple_20.csv" \
        --x "time - 0.3" --y angle --xlim 0,0.66 --ylim 0,60 --xlabel "time from rest [s]" --ylabel "angle beyond the vertical [degree]" \
        --title "Figure 12: an elastic block topples"

    run pile chen2023/pile --set output.frames=6
    run pile_smooth chen2023/pile --set contact.linear.friction=0
    run pile_rough chen2023/pile --set contact.linear.friction=0.625
    figure chen_16_pile.svg "friction 0=runs/pile_smooth" "friction 0.3, the scene=runs/pile" "friction 0.625=runs/pile_rough" --x depth --y resistance \
        --expected "paper=5" --xlabel "depth / radius" --ylabel "resistance of the tip [MPa]" \
        --title "Figure 16: a pile with a cone is driven into sand"

    figure chen_17_pile.svg runs/pile --frames 12,36 --columns 2 --ylim 0,6.2 --xlim 0,5 --colour "stress_yy [kPa]=stress_yy/1000" --clim -2000,0 \
        --title "Figure 17: vertical stress beside the pile"

    run blocks jiang2020/blocks --set output.frames=0.05
    run blocks_gjk chen2023/blocks_gjk
    run blocks_gjk_traction chen2023/blocks_gjk --variant traction
    run blocks_gjk_area chen2023/blocks_gjk --variant area
    figure chen_25_blocks.svg "blocks=runs/blocks" "depth=runs/blocks_gjk" "depth, traction=runs/blocks_gjk_traction" "area=runs/blocks_gjk_area" \
        --y turned_2 --xlim 0.24,0.42 --ylim -5,100 --ylabel "turned [degree]" --title "Figure 25: block 2 is hit by sand"

    run rings chen2023/rings --set output.frames=0.0004
    figure chen_19_rings.svg runs/rings --frames 0.0004,0.0008,0.0012,0.002 --columns 2 --colour "pressure [MPa]=pressure/1e6" \
        --title "Figures 19 and 20: two rings hit each other"

    run dam_break chen2023/dam_break --set output.frames=0.01
    figure chen_27_dam_break.png runs/dam_break --frames 0.2,0.25,0.3,0.4,0.5,0.6 --columns 2 --ylim 0,0.4 --colour "speed [m/s]=speed" --clim 0,4 \
        --title "Figure 27: water hits an elastic plate"

    run dam_break_no_plate chen2023/dam_break --variant no_plate
    figure chen_dam_front.svg "ours=runs/dam_break_no_plate" "potential flow=scenes/chen2023/dam_break_inviscid.csv" \
        "Martin and Moyce 1952, table 2=scenes/chen2023/dam_break_front.csv" --x T --y Z \
        --xlim 0,3.2 --ylim 1,4.1 --xlabel "T = t sqrt(2 g/a)" --ylabel "front / a" \
        --title "Dam break without plate: the front beside potential flow and experiment"
}

bardenhagen2000() {
    for variant in mu_0_9 mu_0_5 mu_0_5_at_30 mu_0_5_at_30_r2 mu_0_5_at_30_r4; do run $variant bardenhagen2000/roll --variant $variant; done
    run roll bardenhagen2000/roll
    figure bardenhagen_02_roll.svg "mu 0.3, 60 degrees=runs/roll" "mu 0.9, 60 degrees=runs/mu_0_9" "mu 0.5, 60 degrees=runs/mu_0_5" \
        "mu 0.5, 30 degrees=runs/mu_0_5_at_30" --y x --y rigid --ylabel "centre of mass down the slope [m]" --xlabel "time [s]" \
        --title "roll: R/8, beside a rigid disc"
    figure bardenhagen_04_roll.svg R/2=runs/mu_0_5_at_30_r2 R/4=runs/mu_0_5_at_30_r4 R/8=runs/mu_0_5_at_30 --y x \
        --expected "rigid=3.27*(min(x,0.3)/60-(1-exp(-60*min(x,0.3)))/3600+(1-exp(-18))/60*max(x-0.3,0)+max(x-0.3,0)^2/2)" --ylabel "centre of mass down the slope [m]" --xlabel "time [s]" \
        --title "roll: mu 0.5 at 30 degrees, three grids"

    run no_slip bardenhagen2000/shear --set output.frames=1.2e-7
    run friction bardenhagen2000/shear --variant friction --set output.frames=1.2e-7
    "$here/shear.py" runs/friction --at 0.25,0.5,0.75 --out runs/profile.csv
    figure bardenhagen_06_grains.png "without slip=runs/no_slip" "friction 0.3=runs/friction" --frames 9e-6 --columns 2 \
        --colour "grain=sin(12.9*group)"
    figure bardenhagen_07_chains.png "friction 0.3=runs/friction" --frames 7.56e-6,8.52e-6 --clim 0,0.4 --columns 2 \
        --colour "principal stress difference [GPa]=sqrt((stress_xx-stress_yy)^2+4*stress_xy^2)/1e9"
    figure bardenhagen_08_profile.svg "friction 0.3=runs/profile.csv" --x x --y "25 %=shear_25" --y "50 %=shear_50" \
        --y "75 %=shear_75" --y "uniform=uniform"
}

sand() {
    study damping verification/transfer_damping --variant quick --repeat 1 --value left \
        --vary 'mpm.transfer="apic",{ blend = { pic_fraction = 0.01 } },{ xpic = { order = 2 } },{ flip_pic = { pic_rate = 100.0 } },{ aflip = { pic_rate = 1000.0 } },{ flip_xpic = { order = 2, pic_rate = 1000.0 } }' \
        --vary time.max_step=7.5e-5,3.75e-5,1.5e-5,7.5e-6,3.75e-6
    figure sand_damping.svg runs/damping/study.csv --x resolution --y left --by curve --xlog --ylog --ylim 0.001,2 --xlabel "step [s]" \
        --ylabel "energy left after 0.06 s [1]" --title "A wave of 12 cells: what ten periods leave of it"
}

[ $# -gt 0 ] || set -- jiang2020 singer2022 chen2023 bardenhagen2000 sand
for page; do $page; done
