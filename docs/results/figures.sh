# The commands that made the figures of docs/results, by page. `docs/results/make` runs those of `tandem plot`.
set -e

# jiang2020.md
tandem plot soft=runs/collision_soft hard=runs/collision_hard --y "rigid disc=v_target^2" --y "elastic disc=v_disc^2" \
    --expected "paper, hard: 1.992^2=1.992^2" --expected "paper, soft: 1.92^2=1.92^2" --xlabel "time [s]" --ylabel "v^2 [m^2/s^2]" \
    --title "Figure 7: squared speeds of two discs that collide" --out docs/results/figures/jiang_07_collision.svg

tandem plot soft=runs/collision_soft hard=runs/collision_hard --y kinetic --y elastic --y contact --xlabel "time [s]" \
    --ylabel "energy [J/m]" --title "Figure 6: energies while the discs collide" --out docs/results/figures/jiang_06_energies.svg

tandem run scenes/jiang2020/drop_soft.toml --in-process --set output.frames=0.001 --out runs/drop_soft
tandem plot runs/drop_soft --frames 0,0.2,0.204,0.206,0.21,0.244 --columns 3 --clim 0,2.5 \
    --title "Figure 8: the soft disc falls and bounces" --out docs/results/figures/jiang_08_drop.svg

tandem plot soft=runs/drop_soft hard=runs/drop_hard --y "v_disc^2" --expected "2 g h=2*9.81*0.204" \
    --expected "paper, hard: 98.95 %=0.9895*2*9.81*0.204" --expected "paper, soft: 93.05 %=0.9305*2*9.81*0.204" --ylabel "v^2 [m^2/s^2]" \
    --title "Figure 9: squared speed of a disc that falls and bounces" --out docs/results/figures/jiang_09_drop.svg

tandem plot soft=runs/drop_soft hard=runs/drop_hard --y kinetic --y elastic --xlim 0.19,0.23 --ylabel "energy [J/m]" \
    --title "Figures 8 and 10: energies during the rebound" --out docs/results/figures/jiang_10_rebound.svg

tandem plot "3.5 mm=runs/normal_force" "4 mm=runs/normal_force_4" "4.5 mm=runs/normal_force_4_5" "5 mm=runs/normal_force_5" \
    --y force --expected "weight=25" --title "Figure 12: force on the floor, four grids" --out docs/results/figures/jiang_12_normal_force.svg

tandem plot runs/friction_force --y friction --expected "mu m g=-7.5" \
    --title "Figure 14: friction of a sliding block" --out docs/results/figures/jiang_14_friction_force.svg

tandem run scenes/jiang2020/silo.toml --variant d4cm --in-process --set time.end=1.0 --set output.frames=0.1 --out runs/silo_4
tandem plot runs/silo_4 --frames 0,0.3,0.5,1 --colour "speed^2 [m^2/s^2]=speed^2" \
    --title "Figure 15: flow out of the silo, 4 cm" --out docs/results/figures/jiang_15_silo.svg

tandem study scenes/jiang2020/silo.toml \
    --vary variant=d2cm,d3cm,d4cm,d5cm,d6cm --vary mpm.points.0.spacing.distance=1.16667e-3,1.1e-3,1.0435e-3 \
    --value "mass flow over Beverloo's law" --resolution variant --in-process --out runs/silo
sed "1s/mass flow over Beverloo's law/flow/" runs/silo/study.csv > runs/silo/flow.csv
tandem plot runs/silo/flow.csv --x "resolution+2" --y "flow*0.58*1500*sqrt(9.81)*(0.01*(resolution+2)-2.2e-3)^1.5" \
    --by mpm.points.0.spacing.distance --dots --expected "Beverloo, 2D=0.58*1500*sqrt(9.81)*(0.01*x-2.2e-3)^1.5" \
    --expected "discs, 1.67 times that=1.67*0.58*1500*sqrt(9.81)*(0.01*x-2.2e-3)^1.5" --xlabel "neck [cm]" \
    --ylabel "mass flow [kg/(m s)]" --title "Figure 16: mass flow out of the silo" --out docs/results/figures/jiang_16_silo.svg

tandem run scenes/jiang2020/blocks.toml --in-process --set output.frames=0.05 --out runs/blocks
tandem plot runs/blocks --frames 0.1,0.25,0.3,0.35,0.4,0.8 --xlim 0,0.5 --ylim -0.01,0.21 --clim 0,2 \
    --title "Figure 20: sand hits the blocks" --out docs/results/figures/jiang_20_snapshots.svg

tandem plot runs/blocks --y "block 2=turned_2" --y "block 1=turned_1" --expected "90 degrees at 0.40 s=90" --ylabel "turned [degree]" \
    --title "Figure 21: blocks hit by sand" --out docs/results/figures/jiang_21_blocks.svg

tandem run scenes/jiang2020/blocks.toml --in-process --out runs/blocks
tandem plot runs/blocks --y "front of the sand=100*front" --y "block 2=100*left_edge_2" --y "block 1=100*left_edge_1" \
    --expected "block 2 at rest=34.6" --expected "block 1 at rest=40.1" --ylabel "left edge, front [cm]" \
    --title "Figure 20: where the blocks and the front are" --out docs/results/figures/jiang_20_blocks.svg

B="tandem run scenes/jiang2020/blocks.toml --in-process --set time.end=0.45 --set time.min_step=1e-8"
$B --variant no_gate --set mpm.transfer=flip --set mpm.leaving=remove --out runs/flip; $B --variant no_gate --out runs/apic
$B --variant no_gate --set time.max_step=5e-6 --out runs/apic5; $B --variant no_gate --set time.max_step=2e-6 --out runs/apic2
tandem plot "FLIP, no gate=runs/flip" "APIC, composed step, no gate=runs/apic" "APIC, 5 us, no gate=runs/apic5" \
    "APIC, 2 us, no gate=runs/apic2" "APIC, composed step, gate at 2 m/s=runs/blocks" --y "100*front" --expected "blocks=30" --xlim ,0.27 \
    --ylabel "front of the sand [cm]" --title "What decides when the sand arrives" --out docs/results/figures/jiang_20_front.svg

tandem run scenes/jiang2020/granular_matrix.toml --in-process --set output.frames=0.02 --out runs/granular_matrix
tandem plot runs/granular_matrix --frames 0,0.22 --xlim -0.02,0.63 --ylim -0.02,0.63 --colour "pressure [kPa]=pressure/1000" \
    --clim 0,300 --title "Figure 22: grains with fines, 35 %" --out docs/results/figures/jiang_22_granular_matrix.svg

tandem plot "26 %=runs/granular_matrix_low" "35 %=runs/granular_matrix" "42 %=runs/granular_matrix_high" --x "100*settlement" \
    --y work_of_the_bar/10 --slope 0.5 --xlabel "settlement [cm]" --ylabel "force on the bar [kN/m]" \
    --title "Figure 23: compression of grains with fines" --out docs/results/figures/jiang_23_granular_matrix.svg

tandem plot "25.7 %=granular/critical_6e7/fines_low" "35.7 %=granular/critical_6e7/fines_middle" \
    "44.3 %=granular/critical_6e7/fines_high" --x "100*settlement" --y work_of_the_bar/10 \
    --slope 0.5 --xlabel "settlement [cm]" --ylabel "force on the bar [kN/m]" \
    --title "Figure 23 at the paper's cell, 3.5 mm" --out docs/results/figures/jiang_23_full.svg

# singer2022.md
tandem run scenes/singer2022/beam_single.toml --out runs/beam_single
tandem run scenes/singer2022/beam_multiple.toml --out runs/beam_multiple
mkdir -p runs/theory && python3 docs/results/beam_reference.py --dt 2e-7 --curves runs/theory
for b in single multiple; do
  tandem plot tandem=runs/beam_$b elasticity=runs/theory/beam_${b}_plane.csv \
    timoshenko=runs/theory/beam_${b}_timoshenko.csv euler=runs/theory/beam_${b}_euler.csv \
    --y force --xlim 0,$([ $b = single ] && echo 2e-4 || echo 3.5e-3) --xlabel "time [s]" \
    --ylabel "force on the ball [N]" --out docs/results/figures/singer_beam_$b.svg
done

tandem run scenes/singer2022/blocks_clusters.toml --in-process --set output.frames=0.01 --out runs/blocks_clusters
tandem plot runs/blocks_clusters --frames 0.25,0.3,0.36,0.38,0.4,0.45 --columns 3 --xlim 0.2,0.5 --ylim -0.01,0.11 --clim 0,2 \
    --title "Figure 10: sand hits blocks of discs" --out docs/results/figures/singer_10_snapshots.svg

tandem plot runs/blocks_clusters --y "block 2=turned_2" --y "block 1=turned_1" --expected "block 2 at 0.40 s, 90 degrees=90" \
    --expected "block 1 at 0.45 s, 180 degrees=180" --xlim 0.24,0.6 --ylabel "turned [degree]" \
    --title "Figure 11: angles of the blocks" --out docs/results/figures/singer_11_blocks.svg

# chen2023.md
tandem run scenes/chen2023/slide_slope.toml --in-process --out runs/slide_slope
tandem plot runs/slide_slope --y "speed [m/s]=v" --y "way [m]=way" --expected "g (sin - mu cos) t=3.5355*x" \
    --expected "half of its square=3.5355*x^2/2" --ylabel "speed [m/s], way [m]" \
    --title "Figure 14: a block slides down 45 degrees" --out docs/results/figures/chen_14_slide_slope.svg

tandem run scenes/chen2023/topple.toml --in-process --out runs/topple_20
tandem run scenes/chen2023/topple.toml --variant slope_18 --in-process --out runs/topple_18
tandem run scenes/chen2023/topple.toml --variant slope_16 --in-process --out runs/topple_16
tandem run scenes/chen2023/topple.toml --variant sudden --in-process --out runs/topple_sudden
tandem plot "16 degrees=runs/topple_16" "18 degrees=runs/topple_18" "20 degrees=runs/topple_20" \
    "16 degrees, put on the slope at once=runs/topple_sudden" "pendulum, 16 degrees=scenes/chen2023/topple_16.csv" \
    "pendulum, 18 degrees=scenes/chen2023/topple_18.csv" "pendulum, 20 degrees=scenes/chen2023/topple_20.csv" \
    --x "time - 0.3" --y angle --xlim 0,0.66 --ylim 0,60 --xlabel "time from rest [s]" --ylabel "angle beyond the vertical [degree]" \
    --title "Figure 12: an elastic block topples" --out docs/results/figures/chen_12_topple.svg

tandem run scenes/chen2023/pile.toml --in-process --set output.frames=6 --out runs/pile
tandem run scenes/chen2023/pile.toml --in-process --set contact.linear.friction=0 --out runs/pile_smooth
tandem run scenes/chen2023/pile.toml --in-process --set contact.linear.friction=0.625 --out runs/pile_rough
tandem plot "friction 0=runs/pile_smooth" "friction 0.3, the scene=runs/pile" "friction 0.625=runs/pile_rough" --x depth --y resistance \
    --expected "paper=5" --xlabel "depth / radius" --ylabel "resistance of the tip [MPa]" \
    --title "Figure 16: a pile with a cone is driven into sand" --out docs/results/figures/chen_16_pile.svg

tandem plot runs/pile --frames 12,36 --columns 2 --ylim 0,6.2 --xlim 0,5 --colour "stress_yy [kPa]=stress_yy/1000" --clim -2000,0 \
    --title "Figure 17: vertical stress beside the pile" --out docs/results/figures/chen_17_pile.svg

tandem run scenes/jiang2020/blocks.toml --in-process --out runs/blocks
tandem run scenes/chen2023/blocks_gjk.toml --in-process --out runs/blocks_gjk
tandem run scenes/chen2023/blocks_gjk.toml --variant traction --in-process --out runs/blocks_gjk_traction
tandem run scenes/chen2023/blocks_gjk.toml --variant area --in-process --out runs/blocks_gjk_area
tandem plot "blocks=runs/blocks" "depth=runs/blocks_gjk" "depth, traction=runs/blocks_gjk_traction" "area=runs/blocks_gjk_area" \
    --y turned_2 --xlim 0.24,0.42 --ylim -5,100 --ylabel "turned [degree]" --title "Figure 25: block 2 is hit by sand" \
    --out docs/results/figures/chen_25_blocks.svg

tandem run scenes/chen2023/rings.toml --in-process --report --out runs/rings
tandem plot runs/rings --frames 0.0004,0.0008,0.0012,0.002 --columns 2 --colour "pressure [MPa]=pressure/1e6" \
    --title "Figures 19 and 20: two rings hit each other" --out docs/results/figures/chen_19_rings.svg

tandem run scenes/chen2023/dam_break.toml --in-process --set output.frames=0.01 --out runs/dam_break
tandem plot runs/dam_break --frames 0.2,0.25,0.3,0.4,0.5,0.6 --columns 2 --ylim 0,0.4 --colour "speed [m/s]=speed" --clim 0,4 \
    --title "Figure 27: water hits an elastic plate" --out docs/results/figures/chen_27_dam_break.png

tandem run scenes/chen2023/dam_break.toml --variant no_plate --in-process --out runs/dam_break_no_plate
tandem plot "ours=runs/dam_break_no_plate" "potential flow=scenes/chen2023/dam_break_inviscid.csv" \
    "Martin and Moyce 1952, table 2=scenes/chen2023/dam_break_front.csv" --x T --y Z \
    --xlim 0,3.2 --ylim 1,4.1 --xlabel "T = t sqrt(2 g/a)" --ylabel "front / a" \
    --title "Dam break without plate: the front beside potential flow and experiment" --out docs/results/figures/chen_dam_front.svg

# bardenhagen2000.md
tandem run scenes/bardenhagen2000/shear.toml --set output.frames=1.2e-7 --out runs/no_slip
tandem run scenes/bardenhagen2000/shear.toml --variant friction --set output.frames=1.2e-7 --out runs/friction
docs/results/shear.py runs/friction --at 0.25,0.5,0.75 --out profile.csv
tandem plot "without slip=runs/no_slip" "friction 0.3=runs/friction" --frames 9e-6 --columns 2 \
    --colour "grain=sin(12.9*group)" --out docs/results/figures/bardenhagen_06_grains.png
tandem plot "friction 0.3=runs/friction" --frames 7.56e-6,8.52e-6 --clim 0,0.4 --columns 2 \
    --colour "principal stress difference [GPa]=sqrt((stress_xx-stress_yy)^2+4*stress_xy^2)/1e9" \
    --out docs/results/figures/bardenhagen_07_chains.png
tandem plot "friction 0.3=profile.csv" --x x --y "25 %=shear_25" --y "50 %=shear_50" \
    --y "75 %=shear_75" --y "uniform=uniform" --out docs/results/figures/bardenhagen_08_profile.svg

# sand.md
tandem study scenes/verification/transfer_damping.toml --variant quick --in-process --repeat 1 --value left \
    --vary 'mpm.transfer="apic",{ blend = { pic_fraction = 0.01 } },{ xpic = { order = 2 } },{ flip_pic = { pic_rate = 100.0 } },{ aflip = { pic_rate = 1000.0 } },{ flip_xpic = { order = 2, pic_rate = 1000.0 } }' \
    --vary time.max_step=7.5e-5,3.75e-5,1.5e-5,7.5e-6,3.75e-6 --out runs/damping
tandem plot runs/damping/study.csv --x resolution --y left --by curve --xlog --ylog --ylim 0.001,2 --xlabel "step [s]" \
    --ylabel "energy left after 0.06 s [1]" --title "A wave of 12 cells: what ten periods leave of it" \
    --out docs/results/figures/sand_damping.svg
