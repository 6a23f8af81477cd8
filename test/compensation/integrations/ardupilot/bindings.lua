-- Of ArduPilot what a script for the dynamic motor matrix meets, as its docs.lua and AP_MotorsMatrix_Scripting_Dynamic
-- have it: motors are added before init and never after, init wants a table of factors and as many motors as there are.
-- Then each line of standard input, the angles of four arms in rad, becomes a line of 16 factors: throttle, roll, pitch
-- and yaw of each motor. (A real pulse is a whole number of microseconds.)
local motors, loaded, ready, told = 0, nil, false, {}
Motors_dynamic = {}
function Motors_dynamic:add_motor(number, order)
  assert(not ready and number == motors and order == motors + 1)
  motors = motors + 1
end
function Motors_dynamic:load_factors(factors) loaded = factors end
function Motors_dynamic:init(expected)
  ready = loaded ~= nil and expected == motors
  return ready
end
local Factors = {}
Factors.__index = Factors
for _, axis in ipairs({"throttle", "roll", "pitch", "yaw"}) do
  Factors[axis] = function(self, index, value)
    assert(index >= 0 and index < 12)
    if value == nil then return self[1][axis .. index] end
    self[1][axis .. index] = value
  end
end
function motor_factor_table() return setmetatable({{}}, Factors) end
SRV_Channels = {}
function SRV_Channels:get_output_pwm(number) return told[number - 93] end
gcs = {}
function gcs:send_text(severity, text) io.write("# ", severity, " ", text, "\n") end

local low, high = tonumber(arg[2]), tonumber(arg[3])  -- end stops of the arms, rad
local update = dofile(arg[1])
for line in io.lines() do
  told = {}
  for angle in line:gmatch("%S+") do
    if angle ~= "unknown" then told[#told + 1] = 1000 + 1000 * (tonumber(angle) - low) / (high - low) end
  end
  local again, pause = update()
  assert(again ~= nil and pause > 0)
  update = again
  for i = 0, motors - 1 do
    io.write(string.format("%.17g %.17g %.17g %.17g ", loaded:throttle(i), loaded:roll(i), loaded:pitch(i), loaded:yaw(i)))
  end
  io.write("\n")
end
