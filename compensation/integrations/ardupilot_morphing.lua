-- What follows is the same for every vehicle: k of each rotor from the angles of the arms, and from k and the places of
-- the rotors the factors of ArduPilot's scripted motor matrix.

local RIGHT_WAY_ROUND = {1, -1, -1}  -- roll, pitch, yaw: ArduPilot's signs from those of x forward, y left, z up

-- phi of a disk at x, y: the part of its rim within the convex body. Each edge leaves out the arc beyond it.
local function rim_arc(x, y)
  local R, arcs, full = vehicle.propeller_radius, {}, 2 * math.pi
  for i, from in ipairs(vehicle.corners) do
    local to = vehicle.corners[i % #vehicle.corners + 1]
    local nx, ny = to[2] - from[2], from[1] - to[1]
    local length = math.sqrt(nx * nx + ny * ny)
    local inside = ((from[1] - x) * nx + (from[2] - y) * ny) / length
    if inside <= -R then return 0 end
    if inside < R then
      local middle, half = math.atan(ny, nx), math.acos(inside / R)
      local low = (middle - half) % full
      local high = low + 2 * half
      arcs[#arcs + 1] = {low, math.min(high, full)}
      if high > full then arcs[#arcs + 1] = {0, high - full} end
    end
  end
  table.sort(arcs, function(a, b) return a[1] < b[1] end)
  local outside, reached = 0, 0
  for _, arc in ipairs(arcs) do
    local low = math.max(arc[1], reached)
    if arc[2] > low then
      outside = outside + arc[2] - low
      reached = arc[2]
    end
  end
  return math.max(0, full - outside)
end

-- Straight between knots {phi, value}, beyond the last as between the last two.
local function at(knots, phi)
  local i = 1
  while i < #knots - 1 and phi >= knots[i + 1][1] do i = i + 1 end
  local a, b = knots[i], knots[i + 1]
  return a[2] + (b[2] - a[2]) / (b[1] - a[1]) * (phi - a[1])
end

-- k over K_T, held in [0.1, 1].
local function k_of(phi)
  if phi <= 0 then return 1 end
  return math.max(0.1, math.min(1, at(propeller.k, phi)))
end

-- How much the torque per thrust grows.
local function drag_scale_of(phi, k)
  if phi <= 0 or #propeller.torque == 0 then return 1 / k end
  return math.max(0.1, math.min(10, at(propeller.torque, phi))) / k
end

-- Solves m x = b in place for all columns of b.
local function solve(m, b)
  for c = 1, 4 do
    local best = c
    for r = c + 1, 4 do if math.abs(m[r][c]) > math.abs(m[best][c]) then best = r end end
    if math.abs(m[best][c]) < 1e-6 then return nil end
    m[c], m[best], b[c], b[best] = m[best], m[c], b[best], b[c]
    for r = 1, 4 do
      if r ~= c then
        local share = m[r][c] / m[c][c]
        for j = 1, 4 do
          m[r][j] = m[r][j] - share * m[c][j]
          b[r][j] = b[r][j] - share * b[c][j]
        end
      end
    end
  end
  for r = 1, 4 do for j = 1, 4 do b[r][j] = b[r][j] / m[r][r] end end
  return b
end

-- What each motor gives for one of throttle, roll, pitch and yaw: the least thrusts, over what k leaves of a full motor.
-- nil: this shape cannot make every torque.
local function motor_shares(angles)
  local n, mass = #vehicle.hinges, vehicle.body[1]
  local gx, gy, hubs = mass * vehicle.body[2], mass * vehicle.body[3], {}
  for i, hinge in ipairs(vehicle.hinges) do
    local beta = hinge.turn + (hinge.mirrored and -angles[i] or angles[i])
    local hub = {hinge.x + vehicle.arm * math.cos(beta), hinge.y + vehicle.arm * math.sin(beta)}
    hubs[i], mass = hub, mass + vehicle.hub_mass
    gx, gy = gx + vehicle.hub_mass * hub[1], gy + vehicle.hub_mass * hub[2]
  end
  -- Rows without units, about 1: ArduPilot's Lua computes in 32 bits.
  local rows, k = {{}, {}, {}, {}}, {}
  for i, hub in ipairs(hubs) do
    local phi = rim_arc(hub[1], hub[2])
    k[i] = k_of(phi)
    rows[1][i] = 1
    rows[2][i] = (hub[2] - gy / mass) / vehicle.arm
    rows[3][i] = -(hub[1] - gx / mass) / vehicle.arm
    rows[4][i] = vehicle.spins[i] * drag_scale_of(phi, k[i])
  end
  local square, unit = {}, {}
  for r = 1, 4 do
    square[r], unit[r] = {}, {}
    for c = 1, 4 do
      local sum = 0
      for i = 1, n do sum = sum + rows[r][i] * rows[c][i] end
      square[r][c], unit[r][c] = sum, r == c and 1 or 0
    end
  end
  local inverse = solve(square, unit)
  if inverse == nil then return nil end
  local shares = {{}, {}, {}, {}}
  for axis = 1, 4 do
    for i = 1, n do
      local sum = 0
      for r = 1, 4 do sum = sum + rows[r][i] * inverse[r][axis] end
      shares[axis][i] = sum / k[i]
    end
  end
  return shares
end

-- As ArduPilot's own frames have them: in the reference shape a motor's throttle is 1 in the mean, and the largest
-- factor of roll, pitch and yaw one half.
local reference = assert(motor_shares(vehicle.reference), "the reference shape cannot make every torque")
local scales = {0, 0, 0, 0}
for i = 1, #vehicle.hinges do
  scales[1] = scales[1] + reference[1][i] / #vehicle.hinges
  for axis = 2, 4 do scales[axis] = math.max(scales[axis], 2 * math.abs(reference[axis][i])) end
end

local function load(shares)
  local factors = motor_factor_table()
  for i = 1, #vehicle.hinges do
    factors:throttle(i - 1, shares[1][i] / scales[1])
    factors:roll(i - 1, RIGHT_WAY_ROUND[1] * shares[2][i] / scales[2])
    factors:pitch(i - 1, RIGHT_WAY_ROUND[2] * shares[3][i] / scales[3])
    factors:yaw(i - 1, RIGHT_WAY_ROUND[3] * shares[4][i] / scales[4])
  end
  Motors_dynamic:load_factors(factors)
end

-- The angles of the arms [rad]; nil for one that nobody knows. ArduPilot has no topic for measured angles: this takes
-- what the servos of Script 1 .. (functions 94 ..) are told, end stop to end stop. Put a measurement here if you have
-- one: a servo that is stuck is not seen otherwise.
local function arm_angles()
  local angles = {}
  for i = 1, #vehicle.hinges do
    local pwm = SRV_Channels:get_output_pwm(93 + i)
    if pwm ~= nil and pwm > 0 then
      local share = (pwm - arms.pwm_min) / (arms.pwm_max - arms.pwm_min)
      angles[i] = arms.low + share * (arms.high - arms.low)
    end
  end
  return angles
end

for i = 1, #vehicle.hinges do Motors_dynamic:add_motor(i - 1, i) end
load(reference)
assert(Motors_dynamic:init(#vehicle.hinges), "Motors_dynamic: set Q_FRAME_CLASS or FRAME_CLASS to 17 and boot")
gcs:send_text(4, "kphi: k is " .. propeller.origin .. ", " .. propeller.verdict)

-- An angle that is unknown or beyond the end stops keeps the one before; a shape that cannot fly keeps its factors.
local known = {}
for i, angle in ipairs(vehicle.reference) do known[i] = angle end

function update()
  local told = arm_angles()
  for i = 1, #vehicle.hinges do
    local angle = told[i]
    if angle ~= nil and angle >= arms.low - 1e-3 and angle <= arms.high + 1e-3 then known[i] = angle end
  end
  local shares = motor_shares(known)
  if shares ~= nil then load(shares) end
  return update, 20  -- ms
end

return update, 20
